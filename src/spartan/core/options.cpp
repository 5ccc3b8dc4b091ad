#include "spartan/core/options.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "spartan/core/files.h"

namespace spartan::options_detail {

// The maps that the visitor is inside of, innermost last, with the keys that were asked for in each.
class Tree {
 public:
  struct Level {
    YAML::Node map;
    std::string prefix;
    std::set<std::string> known;
  };
  std::string name;
  bool has_lines = true;  // false: text of a command line
  std::vector<Level> levels;
  std::vector<YAML::Node> lists;  // open ones, innermost last
  std::vector<std::string> faults;
  std::vector<std::string> warnings;
  std::vector<std::string> given;  // fields

  std::string place(const YAML::Node& node, std::string_view key) const {
    const YAML::Mark mark = node.Mark();
    const std::string line = mark.is_null() || !has_lines ? "" : fmt::format(":{}", mark.line + 1);
    return fmt::format("{}{}: {}{}", name, line, levels.back().prefix, key);
  }
  void fault(const YAML::Node& node, std::string_view key, const std::string& what) {
    faults.push_back(fmt::format("{}: {}", place(node, key), what));
  }

  // The scalar or sequence under `key`, where it is given.
  std::optional<YAML::Node> find(std::string_view key) {
    Level& level = levels.back();
    level.known.insert(std::string(key));
    const YAML::Node map = level.map;  // const: looking must not insert
    if (!map.IsMap()) return std::nullopt;
    const YAML::Node node = map[std::string(key)];
    if (!node.IsDefined()) return std::nullopt;
    return node;
  }

  // The same of a field, which counts as given.
  std::optional<YAML::Node> find_field(std::string_view key) {
    auto node = find(key);
    if (node) given.push_back(levels.back().prefix + std::string(key));
    return node;
  }

  void report_unknown_and_repeated() {
    const Level& level = levels.back();
    if (!level.map.IsMap()) return;
    std::set<std::string> seen;
    for (const auto& entry : level.map) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "(not a name)";
      if (!seen.insert(key).second) fault(entry.first, key, "is given twice");
      if (level.known.contains(key)) continue;
      std::string known;
      for (const std::string& k : level.known) known += (known.empty() ? "" : ", ") + k;
      fault(entry.first, key, "unknown key; known here: " + known);
    }
  }
};

namespace {

template <class T>
std::optional<T> convert(const YAML::Node& node) {
  try {
    return node.as<T>();
  } catch (const YAML::Exception&) {
    return std::nullopt;
  }
}

std::string number(double value) {
  return fmt::format("{}", value);
}

std::string bounds_text(Bounds bounds) {
  if (std::isfinite(bounds.low) && std::isfinite(bounds.high)) {
    return fmt::format("between {} and {}", bounds.low, bounds.high);
  }
  return std::isfinite(bounds.low) ? fmt::format("at least {}", bounds.low) : fmt::format("at most {}", bounds.high);
}

// "a.b.c" → a, b, c
std::vector<std::string> split_key(const std::string& key) {
  std::vector<std::string> parts;
  std::stringstream rest(key);
  for (std::string part; std::getline(rest, part, '.');) parts.push_back(part);
  return parts;
}

bool fits(const std::vector<double>& values, Length length) {
  return length.exactly == 0 || values.size() == static_cast<std::size_t>(length.exactly);
}

std::string length_fault(const std::vector<double>& values, Length length) {
  return fmt::format("has {} numbers, must have {}", values.size(), length.exactly);
}

bool inside(double value, Bounds bounds) {
  return std::isfinite(value) && value >= bounds.low && value <= bounds.high;
}

}  // namespace

void Reader::field(std::string_view key, bool& value, std::string_view) {
  const auto node = tree_->find_field(key);
  if (!node) return;
  if (const auto read = convert<bool>(*node)) {
    value = *read;
  } else {
    tree_->fault(*node, key, "must be true or false");
  }
}

void Reader::field(std::string_view key, int& value, std::string_view, Bounds bounds) {
  const auto node = tree_->find_field(key);
  if (!node) return;
  const auto read = convert<int>(*node);
  if (!read) return tree_->fault(*node, key, "must be a whole number");
  if (!inside(*read, bounds))
    return tree_->fault(*node, key, fmt::format("is {}, must be {}", *read, bounds_text(bounds)));
  value = *read;
}

void Reader::field(std::string_view key, double& value, std::string_view, Bounds bounds) {
  const auto node = tree_->find_field(key);
  if (!node) return;
  const auto read = convert<double>(*node);
  if (!read) return tree_->fault(*node, key, "must be a number");
  if (!std::isfinite(*read)) return tree_->fault(*node, key, "must be a finite number");
  if (!inside(*read, bounds))
    return tree_->fault(*node, key, fmt::format("is {}, must be {}", *read, bounds_text(bounds)));
  value = *read;
}

void Reader::field(std::string_view key, std::string& value, std::string_view,
                   const std::vector<std::string>& choices) {
  const auto node = tree_->find_field(key);
  if (!node) return;
  const auto read = convert<std::string>(*node);
  if (!read || node->IsNull()) return tree_->fault(*node, key, "must be text");
  if (!choices.empty() && std::find(choices.begin(), choices.end(), *read) == choices.end()) {
    return tree_->fault(*node, key, fmt::format("is '{}', must be one of: {}", *read, fmt::join(choices, ", ")));
  }
  value = *read;
}

void Reader::field(std::string_view key, std::vector<double>& value, std::string_view, Bounds bounds, Length length) {
  const auto node = tree_->find_field(key);
  if (!node) return;
  const auto read = convert<std::vector<double>>(*node);
  if (!read) return tree_->fault(*node, key, "must be a list of numbers");
  if (!fits(*read, length)) return tree_->fault(*node, key, length_fault(*read, length));
  for (const double v : *read) {
    if (!inside(v, bounds))
      return tree_->fault(*node, key, fmt::format("holds {}, must be {}", v, bounds_text(bounds)));
  }
  value = *read;
}

void Reader::renamed(std::string_view old_key, std::string_view key) {
  const auto former = tree_->find(old_key);
  Tree::Level& level = tree_->levels.back();
  level.known.erase(std::string(old_key));
  if (!former) return;
  if (tree_->find(key)) {
    return tree_->fault(*former, old_key, fmt::format("is the former name of {}, which is given too", key));
  }
  tree_->warnings.push_back(fmt::format("{} is now called {}; the former name is accepted for this version only",
                                        tree_->place(*former, old_key), key));
  level.map[std::string(key)] = *former;
  level.map.remove(std::string(old_key));
}

void Reader::check(std::string_view key, bool good, std::string_view fault) {
  if (good || !tree_->has_lines) return;
  tree_->fault(tree_->find(key).value_or(tree_->levels.back().map), key, std::string(fault));
}

bool Reader::enter(std::string_view key) {
  const auto node = tree_->find(key);
  if (node && !node->IsMap() && !node->IsNull()) {
    tree_->fault(*node, key, "must be a group of keys");
    return false;
  }
  // A group that is not given is entered too, so that its keys keep their values.
  tree_->levels.push_back({node ? *node : YAML::Node(), tree_->levels.back().prefix + std::string(key) + ".", {}});
  return true;
}

void Reader::leave() {
  tree_->report_unknown_and_repeated();
  tree_->levels.pop_back();
}

std::optional<std::size_t> Reader::open_list(std::string_view key) {
  const auto node = tree_->find(key);
  if (!node) return std::nullopt;
  if (!node->IsSequence()) {
    tree_->fault(*node, key, "must be a list of groups of keys");
    return std::nullopt;
  }
  tree_->lists.push_back(*node);
  return node->size();
}

bool Reader::enter_item(std::string_view key, std::size_t index) {
  const YAML::Node list = tree_->lists.back();
  const YAML::Node item = list[index];
  const std::string name = fmt::format("{}[{}]", key, index);
  if (!item.IsMap()) {
    tree_->fault(item, name, "must be a group of keys");
    return false;
  }
  tree_->levels.push_back({item, tree_->levels.back().prefix + name + ".", {}});
  return true;
}

void Reader::close_list() {
  tree_->lists.pop_back();
}

Status Reader::finish() {
  tree_->report_unknown_and_repeated();
  if (tree_->faults.empty()) return {};
  std::string text;
  for (const std::string& fault : tree_->faults) text += (text.empty() ? "" : "\n") + fault;
  return failure(ErrorCode::configuration, text, {}, "`spartan config dump` lists every option with its meaning");
}

std::vector<std::string> Reader::warnings() const {
  return tree_->warnings;
}

void Reader::add_given(GivenKeys* given) const {
  if (given == nullptr) return;
  for (const std::string& key : tree_->given) given->add(key);
}

void Validator::fault(std::string_view key, std::string_view what) {
  faults_ += fmt::format("{}{}{} {}", faults_.empty() ? "" : "\n", prefix_, key, what);
}
void Validator::field(std::string_view key, const int& value, std::string_view, Bounds bounds) {
  if (!inside(value, bounds)) fault(key, fmt::format("is {}, must be {}", value, bounds_text(bounds)));
}
void Validator::field(std::string_view key, const double& value, std::string_view, Bounds bounds) {
  if (!std::isfinite(value)) return fault(key, "must be a finite number");
  if (!inside(value, bounds)) fault(key, fmt::format("is {}, must be {}", value, bounds_text(bounds)));
}
void Validator::field(std::string_view key, const std::string& value, std::string_view,
                      const std::vector<std::string>& choices) {
  if (choices.empty() || std::find(choices.begin(), choices.end(), value) != choices.end()) return;
  fault(key, fmt::format("is '{}', must be one of: {}", value, fmt::join(choices, ", ")));
}
void Validator::field(std::string_view key, const std::vector<double>& value, std::string_view, Bounds bounds,
                      Length length) {
  if (!fits(value, length)) return fault(key, length_fault(value, length));
  for (const double v : value) {
    if (!inside(v, bounds)) return fault(key, fmt::format("holds {}, must be {}", v, bounds_text(bounds)));
  }
}
Status Validator::finish(std::string_view name) const {
  if (faults_.empty()) return {};
  return failure(ErrorCode::configuration, faults_, std::string(name),
                 "`spartan config dump` lists every option with its meaning");
}

void Lister::field(std::string_view key, const bool& value, std::string_view meaning) {
  lines.push_back({prefix_ + std::string(key), value ? "true" : "false", std::string(meaning)});
}
void Lister::field(std::string_view key, const int& value, std::string_view meaning, Bounds) {
  lines.push_back({prefix_ + std::string(key), std::to_string(value), std::string(meaning)});
}
void Lister::field(std::string_view key, const double& value, std::string_view meaning, Bounds) {
  lines.push_back({prefix_ + std::string(key), number(value), std::string(meaning)});
}
void Lister::field(std::string_view key, const std::string& value, std::string_view meaning,
                   const std::vector<std::string>& choices) {
  std::string text(meaning);
  if (!choices.empty()) text += fmt::format(" ({})", fmt::join(choices, " | "));
  YAML::Emitter quoted;
  quoted << YAML::DoubleQuoted << value;
  lines.push_back({prefix_ + std::string(key), quoted.c_str(), text});
}
void Lister::field(std::string_view key, const std::vector<double>& value, std::string_view meaning, Bounds, Length) {
  lines.push_back({prefix_ + std::string(key), fmt::format("[{}]", fmt::join(value, ", ")), std::string(meaning)});
}

std::string Lister::in_flow_style(const std::vector<OptionLine>& lines) {
  std::string text;
  for (const OptionLine& line : lines) text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", line.key, line.value);
  return "{" + text + "}";
}

Result<std::shared_ptr<Tree>> parse(const std::string& text, const std::string& name) {
  auto tree = std::make_shared<Tree>();
  tree->name = name;
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsNull() && !root.IsMap()) {
      return failure(ErrorCode::configuration, "must be a list of `key: value` lines", name + ":1");
    }
    tree->levels.push_back({root, "", {}});
  } catch (const YAML::ParserException& e) {
    return failure(ErrorCode::configuration, "not valid YAML: " + e.msg, fmt::format("{}:{}", name, e.mark.line + 1));
  } catch (const YAML::Exception& e) {
    return failure(ErrorCode::configuration, "not valid YAML: " + e.msg, name);
  }
  return tree;
}

Result<std::shared_ptr<Tree>> load(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return failure(ErrorCode::configuration, text.error().what, path);
  return parse(*text, path);
}

Result<std::shared_ptr<Tree>> from_assignment(const std::string& assignment) {
  const std::string name = "--set " + assignment;
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    return failure(ErrorCode::usage, "'" + assignment + "' is not of the form key=value", "--set");
  }
  auto tree = std::make_shared<Tree>();
  tree->name = name;
  tree->has_lines = false;
  try {
    // a.b.c=v → {a: {b: {c: v}}}
    YAML::Node node = YAML::Load(assignment.substr(equals + 1));
    std::vector<std::string> keys = split_key(assignment.substr(0, equals));
    std::reverse(keys.begin(), keys.end());
    for (const std::string& key : keys) {
      YAML::Node map(YAML::NodeType::Map);
      map[key] = node;
      node = map;
    }
    tree->levels.push_back({node, "", {}});
  } catch (const YAML::Exception& e) {
    return failure(ErrorCode::usage, "not a valid value: " + e.msg, name);
  }
  return tree;
}

std::string to_yaml(const std::vector<OptionLine>& lines) {
  std::string text;
  std::vector<std::string> open;
  for (const OptionLine& line : lines) {
    const std::vector<std::string> path = split_key(line.key);
    std::size_t same = 0;
    while (same < open.size() && same + 1 < path.size() && open[same] == path[same]) ++same;
    open.resize(same);
    for (; open.size() + 1 < path.size(); open.push_back(path[open.size()])) {
      text += std::string(2 * open.size(), ' ') + path[open.size()] + ":\n";
    }
    text += fmt::format("{}{}: {}  # {}\n", std::string(2 * open.size(), ' '), path.back(), line.value, line.meaning);
  }
  return text;
}

}  // namespace spartan::options_detail

namespace spartan {

GivenKeys GivenKeys::in_group(std::string_view group) const {
  const std::string prefix = std::string(group) + ".";
  GivenKeys inside;
  for (const std::string& key : keys_) {
    if (key.starts_with(prefix)) inside.add(key.substr(prefix.size()));
  }
  return inside;
}

std::string place_of_option(const std::string& text, const std::string& name, const std::string& key) {
  std::string nowhere = fmt::format("{}: {}", name, key);
  try {
    YAML::Node node = YAML::Load(text);
    int line = 0;
    for (const std::string& part : options_detail::split_key(key)) {
      if (!node.IsMap()) return nowhere;
      YAML::Node inner(YAML::NodeType::Undefined);
      for (const auto& entry : node) {
        if (!entry.first.IsScalar() || entry.first.Scalar() != part) continue;
        line = entry.first.Mark().line + 1;
        inner.reset(entry.second);
      }
      if (!inner.IsDefined()) return nowhere;
      node.reset(inner);
    }
    return fmt::format("{}:{}: {}", name, line, key);
  } catch (const YAML::Exception&) {
    return nowhere;
  }
}

}  // namespace spartan
