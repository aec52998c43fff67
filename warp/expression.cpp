#include "warp/expression.h"

#include "surfel/base/error.h"

#include <muParser.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <numbers>
#include <vector>

namespace surflect::warp {

namespace {

constexpr size_t longestText = 4096;

// A parser with storage for its variables. Evaluation writes both, so each thread has its own.
class Program {
public:
  Program(const std::string& text, const std::vector<std::string>& variables) : values_(variables.size()) {
    parser_.DefineConst("pi", std::numbers::pi);
    parser_.DefineConst("e", std::numbers::e);
    for (size_t i = 0; i < variables.size(); ++i) parser_.DefineVar(variables[i], &values_[i]);
    parser_.SetExpr(text);
  }

  double operator()(std::span<const double> values) {
    assert(values.size() == values_.size());
    std::copy(values.begin(), values.end(), values_.begin());
    return parser_.Eval();
  }

  // Number of results: muParser compiles at the first evaluation, and "1, 2" has two.
  int countResults() {
    int count = 0;
    parser_.Eval(count);
    return count;
  }

private:
  mu::Parser parser_;
  std::vector<double> values_;
};

// Returns whether a formula assigns: muParser reads "x = 5" as an assignment, but formulas must have no
// state.
bool assigns(const std::string& text) {
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '=') continue;
    const bool compares = i > 0 && std::string_view("=<>!").find(text[i - 1]) != std::string_view::npos;
    if (!compares && (i + 1 == text.size() || text[i + 1] != '=')) return true;
  }
  return false;
}

void checkText(const std::string& text) {
  if (text.size() > longestText)
    throw Error::mismatch("an expression of at most " + std::to_string(longestText) + " characters",
                          std::to_string(text.size()));
  const auto odd = std::find_if(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; });
  if (odd != text.end())
    throw Error::mismatch("an expression in plain ASCII on one line",
                          "an odd character at position " + std::to_string(odd - text.begin() + 1));
  if (assigns(text))
    throw Error::mismatch("an expression; comparison is ==", "an assignment in \"" + text + '"');
}

} // namespace

class Expression::Compiled {
public:
  Compiled(std::string text, std::span<const std::string_view> variables)
      : text_(std::move(text)), variables_(variables.begin(), variables.end()),
        programs_([this] { return std::make_unique<Program>(text_, variables_); }) {}

  Program& program() const { return *programs_.local(); }
  const std::string& text() const { return text_; }

private:
  std::string text_;
  std::vector<std::string> variables_;
  mutable tbb::enumerable_thread_specific<std::unique_ptr<Program>> programs_;
};

Expression::Expression(std::string text, std::span<const std::string_view> variables) {
  checkText(text);
  auto compiled = std::make_shared<const Compiled>(std::move(text), variables);
  const std::string quoted = '"' + compiled->text() + '"';
  try {
    const int results = compiled->program().countResults();
    if (results != 1) throw Error::mismatch("one", std::to_string(results) + " values in " + quoted);
  } catch (const mu::ParserError& error) {
    const int position = std::clamp(error.GetPos(), 0, static_cast<int>(compiled->text().size()));
    throw Error::mismatch("an expression", quoted + ", wrong at character " + std::to_string(position + 1) +
                                               " (" + error.GetMsg() + ')');
  }
  compiled_ = std::move(compiled);
}

double Expression::operator()(std::span<const double> values) const {
  try {
    return compiled_->program()(values);
  } catch (const mu::ParserError&) { // some builds of muParser throw for 1/0
    return std::numeric_limits<double>::quiet_NaN();
  }
}

} // namespace surflect::warp
