// A strict reader of YAML files: it reports all errors of a file, each with its line and key.
//
//   const Result<YamlNode> root = parse_yaml(text, name);
//   YamlErrors errors(name);
//   YamlMap map(*root, "", errors);
//   if (const auto width = map.integer("width_px")) …
//   map.reject_unknown_keys();
//   if (const Status status = errors.status(); !status) return failure(status);
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// The name that a misspelt word probably means: the closest of `names` by insertions, deletions, substitutions and
/// exchanges of neighbours (optimal string alignment distance), at most a third of its letters away; else empty.
std::string closest_name(std::string_view word, const std::vector<std::string>& names);

struct YamlEntry;

/// A value of a YAML document: null, a scalar, a list or a map. Copies share their content, which is immutable.
class YamlNode {
 public:
  enum class Kind { null, scalar, list, map };

  YamlNode() = default;  ///< null
  /// Nodes made in code instead of read from a file: a scalar, and a map.
  static YamlNode text(std::string scalar);
  static YamlNode map_of(std::vector<YamlEntry> entries);

  Kind kind() const;
  bool is_null() const { return kind() == Kind::null; }
  bool is_scalar() const { return kind() == Kind::scalar; }
  bool is_list() const { return kind() == Kind::list; }
  bool is_map() const { return kind() == Kind::map; }
  /// The text of a scalar without quotes; empty for other kinds.
  const std::string& scalar() const;
  /// The values of a list; empty for other kinds.
  const std::vector<YamlNode>& items() const;
  /// The entries of a map in the order of the file; keys may repeat. Empty for other kinds.
  const std::vector<YamlEntry>& entries() const;
  /// The line in the file, from 1; 0 for a node that is not from a file.
  int line() const;

 private:
  friend class YamlBuilder;
  struct Content;
  std::shared_ptr<const Content> content_;
};

/// One entry of a map. The key of a valid file is a scalar.
struct YamlEntry {
  YamlNode key, value;
};

/// Parses the first document of a text; an empty text is null. Code `configuration` with "name:line" if the text is not
/// UTF-8, not YAML, or has more than 100 000 values, which take hundreds of times their size in the file.
Result<YamlNode> parse_yaml(const std::string& text, const std::string& name);

/// The number, if the whole text is one finite number ("nan" and "inf" are not).
std::optional<double> parse_finite_number(std::string_view text);

/// The text in double quotes, as a YAML scalar on one line.
std::string yaml_quoted(const std::string& text);

/// The errors of one file, and the lines of its keys. Keys are full paths: "cameras.left.focal_px".
class YamlErrors {
 public:
  /// `name` is that of the file. Without `has_lines`, locations have no line numbers (text of a command line).
  explicit YamlErrors(std::string name, bool has_lines = true) : name_(std::move(name)), has_lines_(has_lines) {}

  /// Records the line of a key; the first one counts.
  void set_line(const std::string& key, int line);
  /// "name:line: key" with the line of the key or of the innermost group around it that has one.
  std::string location(const std::string& key) const;
  /// Adds the error "name:line: key: what".
  void add(const std::string& key, const std::string& what);
  /// Whether the key, a key inside it or a group around it has an error.
  bool has_error_near(const std::string& key) const;
  /// All errors in one of code `configuration`, in the order of their lines, at most 50 of them.
  Status status(const std::string& hint = {}) const;
  const std::string& name() const { return name_; }
  bool has_lines() const { return has_lines_; }
  /// The line of a key as in location(); 1 if nothing is recorded.
  int line_of(std::string key) const;

 private:
  struct Line {
    int number;
    std::string text;
  };

  std::string name_;
  bool has_lines_;
  std::map<std::string, int> lines_;
  std::set<std::string> keys_;
  std::vector<Line> errors_;
};

/// Reads one map of a file. Every getter reports what is wrong and then returns nullopt; a missing key is an error
/// except where stated. The keys that were requested are the known ones.
class YamlMap {
 public:
  /// `key` is the path of the map, empty for the root. Reports a node that is not a map, keys that are not scalars, and
  /// repeated keys, of which the first one counts. Keeps a reference to `errors`.
  YamlMap(const YamlNode& node, std::string key, YamlErrors& errors);

  /// Whether the map has the key; the key becomes known.
  bool has(std::string_view key);
  /// The value, or nullopt without an error if the key is missing.
  std::optional<YamlNode> optional_node(std::string_view key);
  std::optional<YamlNode> node(std::string_view key);
  std::optional<std::string> text(std::string_view key);
  std::optional<std::string> choice(std::string_view key, const std::vector<std::string>& choices);
  std::optional<bool> boolean(std::string_view key);
  /// A finite number.
  std::optional<double> number(std::string_view key);
  /// A whole number that fits an int, in any notation ("3", "3.0", "3e0").
  std::optional<int> integer(std::string_view key);
  /// A list of finite numbers; their number must be one of `counts` unless that is empty.
  std::optional<std::vector<double>> numbers(std::string_view key, const std::vector<int>& counts = {});
  /// (name, value) of all entries in the order of the file.
  const std::vector<std::pair<std::string, YamlNode>>& entries() const { return entries_; }

  /// Treats the entry `old_key` as `key`. Reports an error if the map has both; returns whether `old_key` was renamed.
  bool rename(std::string_view old_key, std::string_view key);
  /// Reports every key that is not known.
  void reject_unknown_keys();

  /// The full path of a key of this map.
  std::string path(std::string_view key) const;
  void add_error(std::string_view key, const std::string& what) { errors_.add(path(key), what); }
  YamlErrors& errors() { return errors_; }

 private:
  std::string key_;
  YamlErrors& errors_;
  std::vector<std::pair<std::string, YamlNode>> entries_;
  std::set<std::string, std::less<>> known_;
};

}  // namespace spartan
