// Option structs as classes of Python, made from their descriptions (core/options.h): each field is a property with its
// meaning, its bounds and its default.
#pragma once

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <typeinfo>
#include <utility>
#include <vector>

#include "bindings/errors.h"
#include "bindings/path_text.h"
#include "spartan/core/options.h"

namespace spartan::python {

namespace nb = nanobind;

/// The name of a type without its namespaces.
std::string unqualified_name(const std::type_info& type);

/// Raises ValueError where the value is not within the bounds.
void check_bounds(const std::string& key, double value, Bounds bounds);
/// "at least 0", "0 to 1"; empty without bounds.
std::string bounds_text(Bounds bounds);
/// "Literal['sgm', 'block']"
std::string literal_type(const std::vector<std::string>& choices);
/// Raises ValueError where the name is not one of the choices.
void check_choice(const std::string& key, const std::string& value, const std::vector<std::string>& choices);

template <class Options>
void bind_option_class(nb::module_& m);

/// Adds a property to the class of `Owner` for each field that it describes.
template <class Owner>
class PropertyBinder {
 public:
  PropertyBinder(nb::module_& m, nb::class_<Owner>& bound, Owner& prototype)
      : module_(m), class_(bound), prototype_(prototype) {}

  void field(std::string_view key, bool& value, std::string_view meaning) { plain(key, value, meaning, "bool"); }
  void field(std::string_view key, int& value, std::string_view meaning, Bounds bounds = {}) {
    bounded(key, value, meaning, bounds, "int");
  }
  void field(std::string_view key, double& value, std::string_view meaning, Bounds bounds = {}) {
    bounded(key, value, meaning, bounds, "float");
  }
  void field(std::string_view key, std::string& value, std::string_view meaning,
             const std::vector<std::string>& choices = {}) {
    if (choices.empty()) return plain(key, value, meaning, "str");
    const std::ptrdiff_t at = offset(value);
    const std::string name(key);
    add(
        key, meaning, literal_type(choices), [at](const Owner& o) { return part<std::string>(o, at); },
        [at, name, choices](Owner& o, const std::string& wanted) {
          check_choice(name, wanted, choices);
          part<std::string>(o, at) = wanted;
        });
  }
  void field(std::string_view key, std::vector<double>& value, std::string_view meaning, Bounds bounds = {},
             Length length = {}) {
    const std::ptrdiff_t at = offset(value);
    const std::string name(key);
    const std::string text =
        fmt::format("{}{}{}", length.exactly > 0 ? fmt::format("{} values", length.exactly) : "",
                    length.exactly > 0 && !bounds_text(bounds).empty() ? ", " : "", bounds_text(bounds));
    add(
        key, with_bounds(meaning, text), "list[float]",
        [at](const Owner& o) { return part<std::vector<double>>(o, at); },
        [at, name, bounds, length](Owner& o, std::vector<double> wanted) {
          if (length.exactly > 0 && static_cast<int>(wanted.size()) != length.exactly)
            throw nb::value_error(fmt::format("{}: must have {} values", name, length.exactly).c_str());
          for (const double each : wanted) check_bounds(name, each, bounds);
          part<std::vector<double>>(o, at) = std::move(wanted);
        });
  }
  template <class Enum>
    requires std::is_enum_v<Enum>
  void field(std::string_view key, Enum& value, std::string_view meaning) {
    const std::ptrdiff_t at = offset(value);
    const std::string name(key);
    const auto choices = options_detail::choices_of<Enum>();
    add(
        key, meaning, literal_type(choices), [at](const Owner& o) { return std::string(name_of(part<Enum>(o, at))); },
        [at, name, choices](Owner& o, const std::string& wanted) {
          check_choice(name, wanted, choices);
          part<Enum>(o, at) = *value_named<Enum>(wanted);
        });
  }
  void renamed(std::string_view, std::string_view) {}
  void former(std::string_view, double&, double, std::string_view, Bounds = {}) {}
  void check(std::string_view, bool, std::string_view) {}
  template <class Group>
  void group(std::string_view key, Group& value) {
    bind_option_class<Group>(module_);
    const std::ptrdiff_t at = offset(value);
    const std::string name(key);
    class_.def_prop_rw(
        name.c_str(), [at](Owner& o) -> Group& { return part<Group>(o, at); },
        [at](Owner& o, const Group& wanted) { part<Group>(o, at) = wanted; }, nb::rv_policy::reference_internal);
  }
  template <class Group>
  void list(std::string_view key, std::vector<Group>& values, std::string_view meaning) {
    bind_option_class<Group>(module_);
    const std::ptrdiff_t at = offset(values);
    const std::string item = unqualified_name(typeid(Group));
    add(
        key, meaning, "list[" + item + "]", [at](const Owner& o) { return part<std::vector<Group>>(o, at); },
        [at](Owner& o, std::vector<Group> wanted) { part<std::vector<Group>>(o, at) = std::move(wanted); });
  }

 private:
  template <class T>
  std::ptrdiff_t offset(const T& field) const {
    return reinterpret_cast<const char*>(&field) - reinterpret_cast<const char*>(&prototype_);
  }
  template <class T>
  static T& part(Owner& o, std::ptrdiff_t at) {
    return *reinterpret_cast<T*>(reinterpret_cast<char*>(&o) + at);
  }
  template <class T>
  static const T& part(const Owner& o, std::ptrdiff_t at) {
    return *reinterpret_cast<const T*>(reinterpret_cast<const char*>(&o) + at);
  }
  static std::string with_bounds(std::string_view meaning, const std::string& bounds) {
    return bounds.empty() ? std::string(meaning) : fmt::format("{} Bounds: {}.", meaning, bounds);
  }

  template <class T>
  void plain(std::string_view key, T& value, std::string_view meaning, const char* type) {
    const std::ptrdiff_t at = offset(value);
    add(
        key, fmt::format("{} Default: {}.", meaning, value), type, [at](const Owner& o) { return part<T>(o, at); },
        [at](Owner& o, const T& wanted) { part<T>(o, at) = wanted; });
  }
  template <class T>
  void bounded(std::string_view key, T& value, std::string_view meaning, Bounds bounds, const char* type) {
    const std::ptrdiff_t at = offset(value);
    const std::string name(key);
    add(
        key, with_bounds(fmt::format("{} Default: {}.", meaning, value), bounds_text(bounds)), type,
        [at](const Owner& o) { return part<T>(o, at); },
        [at, name, bounds](Owner& o, T wanted) {
          check_bounds(name, static_cast<double>(wanted), bounds);
          part<T>(o, at) = wanted;
        });
  }
  template <class Get, class Set>
  void add(std::string_view key, std::string_view meaning, const std::string& type, Get get, Set set) {
    const std::string name(key), doc(meaning);
    const std::string getter = fmt::format("def {}(self) -> {}", name, type),
                      setter = fmt::format("def {}(self, value: {}, /) -> None", name, type);
    class_.def_prop_rw(name.c_str(), get, set, nb::for_getter(nb::sig(getter.c_str())),
                       nb::for_setter(nb::sig(setter.c_str())), doc.c_str());
  }

  nb::module_& module_;
  nb::class_<Owner>& class_;
  Owner& prototype_;
};

/// The options that are not the defaults.
template <class Options>
std::vector<OptionLine> changed_options(const Options& options) {
  std::vector<OptionLine> lines = list_options(options);
  const std::vector<OptionLine> defaults = list_options(Options());
  std::erase_if(lines, [&](const OptionLine& line) {
    return std::ranges::any_of(defaults,
                               [&](const OptionLine& d) { return d.key == line.key && d.value == line.value; });
  });
  return lines;
}

/// Sets attributes by name; raises TypeError for one that does not exist.
void set_attributes(nb::handle object, const nb::kwargs& values);

/// Binds the class of an option struct and those of its groups, once. Its name is that of the type.
template <class Options>
void bind_option_class(nb::module_& m) {
  const std::string name = unqualified_name(typeid(Options));
  if (nb::hasattr(m, name.c_str())) return;
  nb::class_<Options> bound(m, name.c_str(), "Options of a run; each property has its meaning, default and bounds.");
  Options prototype;
  PropertyBinder<Options> binder(m, bound, prototype);
  prototype.describe(binder);
  bound.def(
      "__init__",
      [](Options* self, const nb::kwargs& values) {
        // The properties of `self` cannot be set before it is made.
        const nb::object made = nb::cast(Options());
        set_attributes(made, values);
        new (self) Options(nb::cast<const Options&>(made));
      },
      nb::sig("def __init__(self, **values: object) -> None"), "The defaults, but for the given values.");
  bound.def(
      "__eq__", [](const Options& a, const Options& b) { return dump_options(a) == dump_options(b); },
      nb::is_operator(), nb::sig("def __eq__(self, other: object, /) -> bool"));
  bound.def("__copy__", [](const Options& o) { return Options(o); });
  bound.def(
      "__deepcopy__", [](const Options& o, const nb::handle&) { return Options(o); }, nb::arg("memo"));
  bound.def("__getstate__", [](const Options& o) { return dump_options(o); });
  bound.def("__setstate__", [](Options* self, const std::string& yaml) {
    new (self) Options(value_of(parse_options<Options>(yaml, "pickled options")));
  });
  bound.def("__repr__", [name](const Options& o) {
    std::string changed;
    for (const OptionLine& line : changed_options(o)) changed += fmt::format(" {}={}", line.key, line.value);
    return fmt::format("<{}:{}>", name, changed.empty() ? " defaults" : changed);
  });
  bound.def(
      "to_yaml", [](const Options& o) { return dump_options(o); }, "All options with their meanings as YAML.");
  bound.def_static(
      "from_yaml", [](const std::string& text) { return value_of(parse_options<Options>(text, "options")); },
      nb::arg("text"), "The options that a YAML text gives; all others have their defaults.");
  bound.def_static(
      "load", [](const PathText& path) { return value_of(load_options<Options>(path)); }, nb::arg("path"),
      "The options of a YAML file.");
  bound.def(
      "set", [](Options& o, const std::string& assignment) { o = value_of(set_option(o, assignment)); },
      nb::arg("assignment"), "Applies one assignment of a command line, \"group.key=value\".");
}

}  // namespace spartan::python
