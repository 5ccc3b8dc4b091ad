// Option structs and their YAML files.
//
// A struct describes its fields once; reading, dumping and validation are derived from the description:
//
//   struct SpeckleOptions {
//     int size_px = 100;
//     template <class Visitor> void describe(Visitor& v) {
//       v.field("size_px", size_px, "Speckles of fewer pixels are removed; raising it removes larger ones.",
//       at_least(0));
//     }
//   };
//
// Groups nest with `v.group("speckle", speckle)`; `v.list("faults", faults, "…")` is a list of groups. An enum is a
// field where `enum_names(Enum)` lists the names of its values (see EnumName). `v.renamed("old", "new")` before a field
// or a group accepts the key's former name, with a warning; `v.former("key", field, 0.3, "place")` accepts a key whose
// value is now stated elsewhere, with a warning that names the place. `v.check("key", good, "is …")` after the fields
// rejects combinations of values. A former key that is set to `0.3`, its default, counts as not given. A key carries
// its unit (docs/conventions.md).
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// Bounds of a numeric option, both inclusive. Values that are not finite are always rejected.
struct Bounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};
inline Bounds at_least(double low) {
  return {low, std::numeric_limits<double>::infinity()};
}
inline Bounds between(double low, double high) {
  return {low, high};
}

/// Number of values in a list option; 0: any number.
struct Length {
  int exactly = 0;
};

/// The name of an enum value in files. A function in the namespace of the enum lists them (found by argument-dependent
/// lookup):
///
///   enum class Order { rows, columns };
///   constexpr auto enum_names(Order) {
///     return std::array{EnumName{Order::rows, "rows"}, EnumName{Order::columns, "columns"}};
///   }
template <class Enum>
struct EnumName {
  Enum value;
  const char* name;
};
template <class Enum>
EnumName(Enum, const char*) -> EnumName<Enum>;

/// The name of an enum value; empty if enum_names() does not list it.
template <class Enum>
  requires std::is_enum_v<Enum>
constexpr std::string_view name_of(Enum value) {
  for (const auto& entry : enum_names(value)) {
    if (entry.value == value) return entry.name;
  }
  return {};
}

/// The enum value with that name, if there is one.
template <class Enum>
  requires std::is_enum_v<Enum>
constexpr std::optional<Enum> value_named(std::string_view name) {
  for (const auto& entry : enum_names(Enum{})) {
    if (name == entry.name) return entry.value;
  }
  return std::nullopt;
}

/// Keys of options that were given in a file or on a command line, e.g. "localization.imu.gyro_bias_rad_s".
class GivenKeys {
 public:
  void add(std::string key) { keys_.insert(std::move(key)); }
  void add(const GivenKeys& other) { keys_.insert(other.keys_.begin(), other.keys_.end()); }
  bool contains(const std::string& key) const { return keys_.contains(key); }
  const std::set<std::string>& keys() const { return keys_; }
  /// The keys inside a group, without its name.
  GivenKeys in_group(std::string_view group) const;

 private:
  std::set<std::string> keys_;
};

/// Options that were read, and what else the reading tells.
template <class Options>
struct OptionsRead {
  Options options;
  GivenKeys given;                    ///< keys that the text or the assignment contains
  std::vector<std::string> warnings;  ///< one for each former name: "name:line: group.old is now called new; …"
};

/// One line of an option listing: the full key ("reconstruction.sgm.p1"), the value as YAML text, and the meaning.
struct OptionLine {
  std::string key;
  std::string value;
  std::string meaning;
};

namespace options_detail {

// A parsed YAML document; hides the YAML library from this header.
class Tree;

template <class Enum>
std::vector<std::string> choices_of() {
  std::vector<std::string> names;
  for (const auto& entry : enum_names(Enum{})) names.emplace_back(entry.name);
  return names;
}

// Visitor that assigns the values of a YAML document to the described fields.
class Reader {
 public:
  explicit Reader(std::shared_ptr<Tree> tree) : tree_(std::move(tree)) {}

  void field(std::string_view key, bool& value, std::string_view meaning);
  void field(std::string_view key, int& value, std::string_view meaning, Bounds bounds = {});
  void field(std::string_view key, double& value, std::string_view meaning, Bounds bounds = {});
  void field(std::string_view key, std::string& value, std::string_view meaning,
             const std::vector<std::string>& choices = {});
  void field(std::string_view key, std::vector<double>& value, std::string_view meaning, Bounds bounds = {},
             Length length = {});
  template <class Enum>
    requires std::is_enum_v<Enum>
  void field(std::string_view key, Enum& value, std::string_view meaning) {
    std::string name(name_of(value));
    field(key, name, meaning, choices_of<Enum>());
    value = value_named<Enum>(name).value_or(value);
  }
  void renamed(std::string_view old_key, std::string_view key);
  void former(std::string_view key, double& value, double by_default, std::string_view place, Bounds bounds = {});
  /// Not for single options of a command line: the next one may make the values fit.
  void check(std::string_view key, bool good, std::string_view fault);
  template <class Group>
  void group(std::string_view key, Group& value) {
    if (enter(key)) {
      value.describe(*this);
      leave();
    }
  }
  /// A list in the document replaces the whole list.
  template <class Group>
  void list(std::string_view key, std::vector<Group>& values, std::string_view) {
    const std::optional<std::size_t> count = open_list(key);
    if (!count) return;
    values.assign(*count, Group{});
    for (std::size_t i = 0; i < *count; ++i) {
      if (enter_item(key, i)) {
        values[i].describe(*this);
        leave();
      }
    }
    close_list();
  }
  /// All errors of the document in one Error.
  Status finish();
  /// A warning for each former name in the document.
  std::vector<std::string> warnings() const;
  /// The keys of the fields that were read.
  GivenKeys given() const;

 private:
  bool enter(std::string_view key);
  void leave();
  std::optional<std::size_t> open_list(std::string_view key);
  bool enter_item(std::string_view key, std::size_t index);
  void close_list();
  std::shared_ptr<Tree> tree_;
};

// Visitor that lists keys, values and meanings.
class Lister {
 public:
  void field(std::string_view key, const bool& value, std::string_view meaning);
  void field(std::string_view key, const int& value, std::string_view meaning, Bounds bounds = {});
  void field(std::string_view key, const double& value, std::string_view meaning, Bounds bounds = {});
  void field(std::string_view key, const std::string& value, std::string_view meaning,
             const std::vector<std::string>& choices = {});
  void field(std::string_view key, const std::vector<double>& value, std::string_view meaning, Bounds bounds = {},
             Length length = {});
  template <class Enum>
    requires std::is_enum_v<Enum>
  void field(std::string_view key, const Enum& value, std::string_view meaning) {
    field(key, std::string(name_of(value)), meaning, choices_of<Enum>());
  }
  void renamed(std::string_view, std::string_view) {}
  /// Listed only where the value is not the default, so that nothing that was set is lost.
  void former(std::string_view key, const double& value, double by_default, std::string_view place, Bounds = {}) {
    if (value != by_default) field(key, value, "Former key, now stated as " + std::string(place) + ".");
  }
  void check(std::string_view, bool, std::string_view) {}
  template <class Group>
  void group(std::string_view key, Group& value) {
    const std::size_t length = prefix_.size();
    prefix_.append(key).append(".");
    value.describe(*this);
    prefix_.resize(length);
  }
  /// One line: the items in YAML flow style.
  template <class Group>
  void list(std::string_view key, std::vector<Group>& values, std::string_view meaning) {
    std::string items;
    for (Group& value : values) {
      Lister inner;
      value.describe(inner);
      items += (items.empty() ? "" : ", ") + in_flow_style(inner.lines);
    }
    lines.push_back({prefix_ + std::string(key), "[" + items + "]", std::string(meaning)});
  }
  std::vector<OptionLine> lines;

 private:
  static std::string in_flow_style(const std::vector<OptionLine>& lines);
  std::string prefix_;
};

// Visitor that checks values against their bounds and choices.
class Validator {
 public:
  void field(std::string_view, const bool&, std::string_view) {}
  void field(std::string_view key, const int& value, std::string_view meaning, Bounds bounds = {});
  void field(std::string_view key, const double& value, std::string_view meaning, Bounds bounds = {});
  void field(std::string_view key, const std::string& value, std::string_view meaning,
             const std::vector<std::string>& choices = {});
  void field(std::string_view key, const std::vector<double>& value, std::string_view meaning, Bounds bounds = {},
             Length length = {});
  template <class Enum>
    requires std::is_enum_v<Enum>
  void field(std::string_view key, const Enum& value, std::string_view) {
    if (name_of(value).empty()) add_error(key, "is not one of the values of its enum");
  }
  void renamed(std::string_view, std::string_view) {}
  void former(std::string_view key, const double& value, double, std::string_view, Bounds bounds = {}) {
    field(key, value, {}, bounds);
  }
  void check(std::string_view key, bool good, std::string_view what) {
    if (!good) add_error(key, what);
  }
  template <class Group>
  void group(std::string_view key, Group& value) {
    const std::size_t length = prefix_.size();
    prefix_.append(key).append(".");
    value.describe(*this);
    prefix_.resize(length);
  }
  template <class Group>
  void list(std::string_view key, std::vector<Group>& values, std::string_view) {
    for (std::size_t i = 0; i < values.size(); ++i) group(std::string(key) + "[" + std::to_string(i) + "]", values[i]);
  }
  /// All errors in one Error.
  Status finish(std::string_view name) const;

 private:
  void add_error(std::string_view key, std::string_view what);
  std::string prefix_;
  std::string errors_;
};

Result<std::shared_ptr<Tree>> parse(const std::string& text, const std::string& name);
Result<std::shared_ptr<Tree>> load(const std::string& path);
Result<std::shared_ptr<Tree>> from_assignment(const std::string& assignment);
std::string to_yaml(const std::vector<OptionLine>& lines);

}  // namespace options_detail

/// The location "name:line: group.key" of a key in a YAML text, for errors that concern several keys; "name: group.key"
/// if the text does not have the key.
std::string option_location(const std::string& text, const std::string& name, const std::string& key);

namespace options_detail {

template <class Options>
Result<OptionsRead<Options>> read(const Result<std::shared_ptr<Tree>>& tree, Options defaults) {
  if (!tree) return failure(tree);
  Reader reader(*tree);
  defaults.describe(reader);
  if (Status status = reader.finish(); !status) return failure(status);
  return OptionsRead<Options>{std::move(defaults), reader.given(), reader.warnings()};
}

template <class Options>
Result<Options> options_of(Result<OptionsRead<Options>> read) {
  if (!read) return failure(read);
  return std::move(read->options);
}

}  // namespace options_detail

/// Reads options from YAML text. Fields that the text does not contain keep their values in `defaults`. Unknown and
/// repeated keys, wrong types and values out of bounds are errors (code `configuration`), all reported in one Error,
/// each on a line "name:line: key: reason". Former names of keys are accepted for one version, with a warning.
template <class Options>
Result<OptionsRead<Options>> read_options(const std::string& text, const std::string& name, Options defaults = {}) {
  return options_detail::read(options_detail::parse(text, name), std::move(defaults));
}

/// The same from a file; code `configuration` also if the file cannot be read.
template <class Options>
Result<OptionsRead<Options>> read_options_file(const std::string& path, Options defaults = {}) {
  return options_detail::read(options_detail::load(path), std::move(defaults));
}

/// Applies one assignment "group.key=value" of a command line. Errors have code `usage`.
template <class Options>
Result<OptionsRead<Options>> read_assignment(const std::string& assignment, Options options = {}) {
  auto read = options_detail::read(options_detail::from_assignment(assignment), std::move(options));
  if (!read) read.error().code = ErrorCode::usage;
  return read;
}

/// The options alone, of read_options(), read_options_file() and read_assignment().
template <class Options>
Result<Options> parse_options(const std::string& text, const std::string& name, Options defaults = {}) {
  return options_detail::options_of(read_options(text, name, std::move(defaults)));
}
template <class Options>
Result<Options> load_options(const std::string& path, Options defaults = {}) {
  return options_detail::options_of(read_options_file(path, std::move(defaults)));
}
template <class Options>
Result<Options> set_option(Options options, const std::string& assignment) {
  return options_detail::options_of(read_assignment(assignment, std::move(options)));
}

/// Checks values that were set in code against the bounds and choices of their description. `name` names the options in
/// the error ("odometry options"). The error (code `configuration`) lists every invalid field with its value and
/// bounds.
template <class Options>
Status validate(Options options, std::string_view name) {
  options_detail::Validator validator;
  options.describe(validator);
  return validator.finish(name);
}

/// Every option with its value and meaning, in the order of the description.
template <class Options>
std::vector<OptionLine> list_options(Options options) {
  options_detail::Lister lister;
  options.describe(lister);
  return lister.lines;
}

/// The options as YAML with their meanings as comments; parse_options() restores the same values bit for bit.
template <class Options>
std::string dump_options(const Options& options) {
  return options_detail::to_yaml(list_options(options));
}

}  // namespace spartan
