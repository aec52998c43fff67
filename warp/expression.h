// A formula that a user wrote, compiled when it is made and evaluated from any thread.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace surflect::warp {

// Operators and functions are muParser's (+ - * / ^ comparisons ?: sin cos exp min ...), constants pi and e;
// the decimal mark is a point whatever the locale. Copies share what was compiled.
class Expression {
public:
  // `variables` are the names that may occur, in the order in which values are given later.
  // Throws Error with the expression and the character at which it goes wrong.
  Expression(std::string text, std::span<const std::string_view> variables);

  // One value per variable. Never throws: where the formula has no value (1/0, sqrt(-1)) it is infinite or
  // NaN.
  double operator()(std::span<const double> values) const;

private:
  class Compiled;
  std::shared_ptr<const Compiled> compiled_;
};

} // namespace surflect::warp
