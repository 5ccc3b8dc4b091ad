// Reading a YAML map key by key, with every fault of the file collected. Internal to rig: the parser's types show.
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

/// The faults of one file, and the lines where its keys stand.
class YamlFaults {
 public:
  explicit YamlFaults(std::string name) : name_(std::move(name)) {}

  /// Remembers where a key stands. Keys are whole paths, "cameras.left.focal_px".
  void saw(const std::string& key, const YAML::Node& node);
  /// "name:line: key: what", the line being that of the key or of the nearest group around it.
  void add(const std::string& key, const std::string& what);
  /// Whether the key, a key inside of it or a group around it has a fault.
  bool touches(const std::string& key) const;
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

/// Loads the text; code `configuration` with the line where it is not YAML.
Result<YAML::Node> load_yaml(const std::string& text, const std::string& name);

/// A finite number in full; "nan" and "inf" are none.
std::optional<double> parse_number(std::string_view text);

/// One map of the file. Every getter reports what is wrong and remembers the key; a value that cannot be had is none.
class YamlMap {
 public:
  /// `key` is the path of the map, empty for the root. Reports a node that is no map, and keys given twice.
  YamlMap(const YAML::Node& node, std::string key, YamlFaults& faults);

  bool has(std::string_view key) const;
  std::optional<YAML::Node> optional_node(std::string_view key);
  std::optional<YAML::Node> node(std::string_view key);  ///< a missing key is a fault
  std::optional<std::string> text(std::string_view key);
  std::optional<std::string> choice(std::string_view key, const std::vector<std::string>& choices);
  std::optional<bool> boolean(std::string_view key);
  std::optional<double> number(std::string_view key);
  std::optional<int> integer(std::string_view key);
  std::optional<std::vector<double>> numbers(std::string_view key, const std::vector<int>& counts);
  /// The entries in the order of the file: (name, node).
  std::vector<std::pair<std::string, YAML::Node>> entries() const { return entries_; }

  /// Reports every key that none of the getters asked for.
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
