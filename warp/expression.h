// User-written formula, compiled at construction and evaluated from any thread.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace surflect::warp {

// Operators and functions are muParser's (+ - * / ^ comparisons ?: sin cos exp min ...), constants pi and e;
// the decimal mark is a point in any locale. Copies share the compiled form.
class Expression {
public:
  // `variables` are the names that may occur, in the order of the values given later. Throws Error with the
  // expression and the position of the fault.
  Expression(std::string text, std::span<const std::string_view> variables);

  // Value of the formula, with one number per variable. Never throws: without a value (1/0, sqrt(-1)) it is
  // infinite or NaN.
  double operator()(std::span<const double> values) const;

private:
  class Compiled;
  std::shared_ptr<const Compiled> compiled_;
};

} // namespace surflect::warp
