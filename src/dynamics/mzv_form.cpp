// Reads a shaper's type as Klipper spells it (shaper_defs.py, init_shaper).
#include <array>
#include <charconv>
#include <cstddef>
#include <string>
#include <utility>

#include "unflex/dynamics/shapers.hpp"

namespace unflex::dynamics {
namespace {

std::string without_blanks(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c != ' ' && c != '\t') {
      result += c;
    }
  }
  return result;
}

template <class Number>
bool read(std::string_view text, Number& target) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, target);
  return error == std::errc() && stop == end && target >= 0;
}

// The parameters as they are given; 0 stands for none, as in Klipper.
struct Given {
  int n = 3;
  double t = 0.0;
  double tau = 0.0;

  bool take(std::string_view name, std::string_view value) {
    if (name == "n") {
      return read(value, n);
    }
    return name == "t" ? read(value, t) : name == "tau" && read(value, tau);
  }

  [[nodiscard]] MzvForm form() const {
    if (tau > 0.0) {
      return {n, tau * (n - 1) / (n + 2.0 * tau - 2.0)};
    }
    return {n, t > 0.0 ? t : MzvForm{}.duration_periods};
  }
};

// Parameters with names or in their order, not mixed.
std::optional<Given> parameters(std::string_view text) {
  constexpr std::array<std::string_view, 3> kOrder = {"n", "t", "tau"};
  Given given;
  bool named = false;
  for (std::size_t i = 0; !text.empty(); ++i) {
    const std::size_t comma = text.find(',');
    const std::string_view one = text.substr(0, comma);
    text.remove_prefix(comma == std::string_view::npos ? text.size() : comma + 1);
    const std::size_t equals = one.find('=');
    const bool has_name = equals != std::string_view::npos;
    if (i >= kOrder.size() || (i > 0 && has_name != named)) {
      return std::nullopt;
    }
    named = has_name;
    if (!given.take(has_name ? one.substr(0, equals) : kOrder[i],
                    has_name ? one.substr(equals + 1) : one)) {
      return std::nullopt;
    }
  }
  return given;
}

}  // namespace

std::optional<MzvForm> mzv_form(std::string_view text) {
  constexpr std::string_view kName = "mzv";
  const std::string dense = without_blanks(text);
  std::string_view rest = dense;
  if (!rest.starts_with(kName)) {
    return std::nullopt;
  }
  rest.remove_prefix(kName.size());
  if (rest.empty()) {
    return MzvForm{};
  }
  if (rest.size() < 2 || rest.front() != '(' || rest.back() != ')') {
    return std::nullopt;
  }
  const auto given = parameters(rest.substr(1, rest.size() - 2));
  if (!given || !given->form().is_defined()) {
    return std::nullopt;
  }
  return given->form();
}

}  // namespace unflex::dynamics
