// Rows bound to the members of a struct: a method's options as the method itself reads them.
//
//   struct LookOptions { int samples = 2; Order order = Order::list; };
//   const Rows<LookOptions> kRows{
//       row("samples", [](auto& o) -> auto& { return o.samples; }, {.domain = wholeRange(1, 8), .help =
//       "..."}), row("order", [](auto& o) -> auto& { return o.order; }, {.domain = words({"list", "peel"}),
//       .help = "..."})};
//
// The default of a row is the value of its member in a new struct.
#pragma once

#include "render/method/option.h"

#include <algorithm>
#include <concepts>
#include <functional>
#include <optional>
#include <type_traits>

namespace surflect::method {

template <class Struct> struct Row {
  Option option;
  std::function<void(Struct&, const Value&)> set;
};
template <class Struct> using Rows = std::vector<Row<Struct>>;

inline std::vector<Value> words(std::initializer_list<const char*> words) {
  return {words.begin(), words.end()};
}

namespace detail {

template <class T> struct IsOptional : std::false_type {};
template <class T> struct IsOptional<std::optional<T>> : std::true_type {};

// An enumerator stands for the choice at its place.
template <class T> T memberOf(const Value& value, const Option& option) {
  if constexpr (std::same_as<T, bool>) {
    return value == Value(kOn);
  } else if constexpr (std::is_enum_v<T>) {
    const auto& choices = std::get<std::vector<Value>>(option.domain);
    return static_cast<T>(std::ranges::find(choices, value) - choices.begin());
  } else {
    return static_cast<T>(value.number());
  }
}

template <class T> Value valueOf(const T& member, const Option& option) {
  if constexpr (std::same_as<T, bool>)
    return member ? kOn : kOff;
  else if constexpr (std::is_enum_v<T>)
    return std::get<std::vector<Value>>(option.domain)[static_cast<size_t>(member)];
  else
    return static_cast<double>(member);
}

} // namespace detail

// Row of the member that `access` returns of a Struct: a number, a bool, an enumeration whose enumerators are
// the choices in their order, or an optional one of these, which has no default of its own.
template <class Struct, class Access> Row<Struct> row(std::string name, Access access, Option option) {
  using Member = std::remove_cvref_t<decltype(access(std::declval<Struct&>()))>;
  constexpr bool isOptional = detail::IsOptional<Member>::value;
  option.name = std::move(name);
  if constexpr (isOptional) {
    using Inner = typename Member::value_type;
    if constexpr (std::same_as<Inner, bool>) option.domain = words({kOn, kOff});
    return {option, [access, option](Struct& into, const Value& value) {
              access(into) = detail::memberOf<Inner>(value, option);
            }};
  } else {
    if constexpr (std::same_as<Member, bool>) option.domain = words({kOn, kOff});
    Struct fresh{};
    option.standard = detail::valueOf<Member>(access(fresh), option);
    return {option, [access, option](Struct& into, const Value& value) {
              access(into) = detail::memberOf<Member>(value, option);
            }};
  }
}

template <class Struct> std::vector<Option> optionsOf(const Rows<Struct>& rows) {
  std::vector<Option> options;
  for (const Row<Struct>& each : rows) options.push_back(each.option);
  return options;
}

// `base` with the values of a setting, which has passed requireSetting().
template <class Struct> Struct applied(Struct base, const Rows<Struct>& rows, const Setting& setting) {
  for (const Row<Struct>& each : rows)
    if (const auto found = setting.find(each.option.name); found != setting.end())
      each.set(base, found->second);
  return base;
}

} // namespace surflect::method
