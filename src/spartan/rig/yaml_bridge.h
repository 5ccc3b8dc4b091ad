// Reads a YAML map key by key and collects all errors of the file. Internal: it exposes types of yaml-cpp.
#pragma once

#include <yaml-cpp/yaml.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "spartan/core/result.h"

namespace spartan::rig_detail {

/// The errors of one file, and the line of each of its keys.
class YamlFaults {
 public:
  explicit YamlFaults(std::string name) : name_(std::move(name)) {}

  /// Records the line of a key. Keys are full paths, "cameras.left.focal_px".
  void saw(const std::string& key, const YAML::Node& node);
  /// Adds "name:line: key: what", with the line of the key or of the innermost group that contains it.
  void add(const std::string& key, const std::string& what);
  /// Whether the key, a key inside it or a group around it has an error.
  bool touches(const std::string& key) const;
  /// All errors in one, code `configuration`, ordered by line.
  Status status() const;
  const std::string& name() const { return name_; }

 private:
  struct Line {
    int number;
    std::string text;
  };
  int line_of(std::string key) const;

  std::string name_;
  std::map<std::string, int> lines_;
  std::set<std::string> keys_;
  std::vector<Line> faults_;
};

/// Parses the text. Code `configuration`, with the line, where it is not UTF-8 or not YAML.
Result<YAML::Node> load_yaml(const std::string& text, const std::string& name);

/// The number, if the whole text is one and it is finite.
std::optional<double> parse_number(std::string_view text);

/// One map of the file. Each getter records its key as known, reports errors, and returns none where there is no valid
/// value.
class YamlMap {
 public:
  /// `key` is the path of the map, empty for the root. Reports a node that is not a map, and duplicate keys.
  YamlMap(const YAML::Node& node, std::string key, YamlFaults& faults);

  bool has(std::string_view key) const;
  std::optional<YAML::Node> optional_node(std::string_view key);
  std::optional<YAML::Node> node(std::string_view key);  ///< a missing key is an error
  std::optional<std::string> text(std::string_view key);
  std::optional<std::string> choice(std::string_view key, const std::vector<std::string>& choices);
  std::optional<bool> boolean(std::string_view key);
  std::optional<double> number(std::string_view key);
  std::optional<int> integer(std::string_view key);
  std::optional<std::vector<double>> numbers(std::string_view key, const std::vector<int>& counts);
  /// (name, node) in the order of the file.
  std::vector<std::pair<std::string, YAML::Node>> entries() const { return entries_; }

  /// Reports every key that no getter has requested.
  void refuse_unknown_keys();

  std::string path(std::string_view key) const;
  void fault(std::string_view key, const std::string& what) { faults_.add(path(key), what); }
  YamlFaults& faults() { return faults_; }

 private:
  std::string key_;
  YamlFaults& faults_;
  std::vector<std::pair<std::string, YAML::Node>> entries_;
  std::set<std::string, std::less<>> known_;
};

}  // namespace spartan::rig_detail
