#include "spartan/camera/internal/layouts/name_numbers.h"

#include <algorithm>
#include <array>
#include <set>

#include "spartan/camera/internal/table.h"

namespace spartan::internal {
namespace {

struct Unit {
  StampUnit unit;
  std::string_view name;
  std::int64_t per_second, ns;
};
constexpr std::array<Unit, 4> kUnits{{
    {StampUnit::seconds, "seconds", 1, 1'000'000'000},
    {StampUnit::milliseconds, "milliseconds", 1'000, 1'000'000},
    {StampUnit::microseconds, "microseconds", 1'000'000, 1'000},
    {StampUnit::nanoseconds, "nanoseconds", 1'000'000'000, 1},
}};

constexpr std::int64_t kYear2001_s = 1'000'000'000, kYear2100_s = 4'102'444'800;
constexpr std::int64_t kHighestRate_hz = 200;  // the lowest is 1
constexpr std::size_t kSecondsDigits = 10, kNanosecondsDigits = 9;

bool is_digit(std::string_view text, std::size_t i) {
  return i < text.size() && text[i] >= '0' && text[i] <= '9';
}

std::size_t end_of_digits(std::string_view text, std::size_t i) {
  while (is_digit(text, i)) ++i;
  return i;
}

// Decimal numbers of a name, "12" or "12.5"; seconds and nanoseconds joined by '_' or '-' become one of them.
std::vector<std::string> numbers_of(std::string_view name) {
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < name.size();) {
    if (!is_digit(name, i)) {
      ++i;
      continue;
    }
    const std::size_t whole = end_of_digits(name, i), end = end_of_digits(name, whole + 1);
    const bool more = whole < name.size() && end > whole + 1;
    const bool after_point = i >= 2 && name[i - 1] == '.' && is_digit(name, i - 2);
    const bool before_point = end < name.size() && name[end] == '.';
    const bool decimal = more && name[whole] == '.' && !after_point && !before_point;  // a date has two points
    const bool joined = more && (name[whole] == '_' || name[whole] == '-') && whole - i == kSecondsDigits &&
                        end - whole - 1 == kNanosecondsDigits;
    std::string number(name.substr(i, whole - i));
    if (decimal || joined) number += "." + std::string(name.substr(whole + 1, end - whole - 1));
    numbers.push_back(std::move(number));
    i = decimal || joined ? end : whole;
  }
  return numbers;
}

std::optional<NameNumbers> parse(const std::vector<std::string>& texts) {
  NameNumbers numbers;
  numbers.decimal_seconds =
      std::any_of(texts.begin(), texts.end(), [](const std::string& t) { return t.find('.') != std::string::npos; });
  for (const std::string& text : texts) {
    if (numbers.decimal_seconds) {
      const auto stamp = parse_decimal_seconds(text);
      if (!stamp || !is_in_range(*stamp)) return std::nullopt;
      numbers.values.push_back(stamp->ns);
    } else {
      const auto value = parse_number<std::int64_t>(text);
      if (!value) return std::nullopt;
      numbers.values.push_back(*value);
    }
  }
  return numbers;
}

std::vector<std::int64_t> steps_of(const std::vector<std::int64_t>& sorted) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < sorted.size(); ++i) steps.push_back(sorted[i] - sorted[i - 1]);
  std::sort(steps.begin(), steps.end());
  return steps;
}

}  // namespace

std::string_view name_of(StampUnit unit) {
  return kUnits[static_cast<std::size_t>(unit)].name;
}

std::optional<NameNumbers> numbers_in_names(const std::vector<std::string>& stems) {
  std::vector<std::vector<std::string>> columns;  // the numbers of all names, by place in the name
  for (const std::string& stem : stems) {
    const std::vector<std::string> numbers = numbers_of(stem);
    if (columns.empty()) columns.resize(numbers.size());
    if (numbers.size() != columns.size()) return std::nullopt;
    for (std::size_t i = 0; i < numbers.size(); ++i) columns[i].push_back(numbers[i]);
  }
  std::optional<NameNumbers> best;
  std::size_t best_length = 0;
  for (const std::vector<std::string>& column : columns) {
    std::optional<NameNumbers> numbers = parse(column);
    if (!numbers || column.front().size() < best_length) continue;
    if (std::set<std::int64_t>(numbers->values.begin(), numbers->values.end()).size() < stems.size()) continue;
    best = std::move(numbers);
    best_length = column.front().size();
  }
  return best;
}

std::optional<StampUnit> stamp_unit(std::vector<std::int64_t> values) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  for (const Unit& unit : kUnits) {
    if (values.front() >= kYear2001_s * unit.per_second && values.back() / unit.per_second < kYear2100_s)
      return unit.unit;
  }
  const std::vector<std::int64_t> steps = steps_of(values);
  if (steps.empty() || values.front() < 0) return std::nullopt;
  const std::int64_t median = steps[steps.size() / 2];
  for (const Unit& unit : kUnits) {
    if (unit.unit == StampUnit::seconds || median > unit.per_second || median < unit.per_second / kHighestRate_hz)
      continue;
    if (unit.unit == StampUnit::milliseconds && steps.front() == steps.back()) continue;
    return unit.unit;
  }
  return std::nullopt;
}

std::optional<Stamp> to_stamp(std::int64_t value, StampUnit unit) {
  const Unit& of = kUnits[static_cast<std::size_t>(unit)];
  constexpr std::int64_t kMost_s = 4'600'000'000;  // as is_in_range()
  if (value > kMost_s * of.per_second || value < -kMost_s * of.per_second) return std::nullopt;
  return Stamp{value * of.ns};
}

}  // namespace spartan::internal
