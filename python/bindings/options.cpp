#include "spartan/core/options.h"

#include <cxxabi.h>

#include <cmath>
#include <cstdlib>
#include <memory>

#include "bindings/bindings.h"
#include "bindings/option_classes.h"
#include "spartan/system/run_options.h"

namespace spartan::python {

std::string unqualified_name(const std::type_info& type) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> name(abi::__cxa_demangle(type.name(), nullptr, nullptr, &status),
                                                    std::free);
  const std::string full(status == 0 ? name.get() : type.name());
  return full.substr(full.rfind(':') + 1);
}

std::string bounds_text(Bounds bounds) {
  const bool low = std::isfinite(bounds.low), high = std::isfinite(bounds.high);
  if (low && high) return fmt::format("{} to {}", bounds.low, bounds.high);
  if (low) return fmt::format("at least {}", bounds.low);
  return high ? fmt::format("at most {}", bounds.high) : "";
}

void check_bounds(const std::string& key, double value, Bounds bounds) {
  if (!std::isfinite(value)) throw nb::value_error((key + ": must be finite").c_str());
  if (value < bounds.low || value > bounds.high)
    throw nb::value_error(fmt::format("{} = {}: must be {}", key, value, bounds_text(bounds)).c_str());
}

std::string literal_type(const std::vector<std::string>& choices) {
  std::string names;
  for (const std::string& choice : choices) names += (names.empty() ? "'" : ", '") + choice + "'";
  return "typing.Literal[" + names + "]";
}

void check_choice(const std::string& key, const std::string& value, const std::vector<std::string>& choices) {
  std::string names;
  for (const std::string& choice : choices) {
    if (choice == value) return;
    names += (names.empty() ? "" : ", ") + choice;
  }
  throw nb::value_error(fmt::format("{} = '{}': must be one of {}", key, value, names).c_str());
}

void set_attributes(nb::handle object, const nb::kwargs& values) {
  for (const auto& [key, value] : values) {
    if (!nb::hasattr(object, key)) {
      throw nb::type_error(fmt::format("{} has no option '{}'",
                                       nb::cast<std::string>(nb::str(object.type().attr("__name__"))),
                                       nb::cast<std::string>(nb::str(key)))
                               .c_str());
    }
    nb::setattr(object, key, value);
  }
}

void bind_options(nb::module_& m) {
  bind_option_class<RunOptions>(m);
}

}  // namespace spartan::python
