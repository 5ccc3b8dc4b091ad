#include "spartan/core/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spartan/core/files.h"
#include "spartan/core/strict_yaml.h"

namespace spartan::options_detail {

// A YAML document and the state of its traversal: the open groups and lists, innermost last.
class Tree {
 public:
  Tree(std::string name, const YamlNode& root, bool has_lines) : errors(std::move(name), has_lines) { enter(root, ""); }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  // A group without content has no keys.
  void enter(const YamlNode& node, const std::string& path) {
    levels.emplace_back(node.is_null() ? YamlNode::map_of({}) : node, path, errors);
  }

  YamlErrors errors;
  std::vector<YamlMap> levels;
  std::vector<YamlNode> lists;
  std::vector<std::string> warnings;
  std::vector<std::string> given;  // keys of the fields that the document has

  // Whether the document has the field.
  bool find_field(std::string_view key) {
    if (!levels.back().has(key)) return false;
    given.push_back(levels.back().path(key));
    return true;
  }
};

namespace {

constexpr const char* kOptionsHint =
    "`spartan config dump --all` lists the options of a run, docs/reference/scenario.md those of a scenario";

std::string number(double value) {
  return fmt::format("{}", value);
}

std::string bounds_text(Bounds bounds) {
  if (bounds.low == bounds.high) return fmt::format("{}", bounds.low);
  if (std::isfinite(bounds.low) && std::isfinite(bounds.high)) {
    return fmt::format("between {} and {}", bounds.low, bounds.high);
  }
  return std::isfinite(bounds.low) ? fmt::format("at least {}", bounds.low) : fmt::format("at most {}", bounds.high);
}

// The meaning of a numeric option, followed by its range if it has one.
std::string with_range(std::string_view meaning, Bounds bounds) {
  if (!std::isfinite(bounds.low) && !std::isfinite(bounds.high)) return std::string(meaning);
  return fmt::format("{} ({})", meaning, bounds_text(bounds));
}

// "a.b.c" → a, b, c
std::vector<std::string> split_key(const std::string& key) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at < key.size();) {
    const std::size_t end = std::min(key.find('.', at), key.size());
    parts.push_back(key.substr(at, end - at));
    at = end + 1;
  }
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
  if (tree_->find_field(key)) value = tree_->levels.back().boolean(key).value_or(value);
}

void Reader::field(std::string_view key, int& value, std::string_view, Bounds bounds) {
  YamlMap& map = tree_->levels.back();
  const auto read = tree_->find_field(key) ? map.integer(key) : std::nullopt;
  if (!read) return;
  if (!inside(*read, bounds)) return map.add_error(key, fmt::format("is {}, must be {}", *read, bounds_text(bounds)));
  value = *read;
}

void Reader::field(std::string_view key, double& value, std::string_view, Bounds bounds) {
  YamlMap& map = tree_->levels.back();
  const auto read = tree_->find_field(key) ? map.number(key) : std::nullopt;
  if (!read) return;
  if (!inside(*read, bounds)) return map.add_error(key, fmt::format("is {}, must be {}", *read, bounds_text(bounds)));
  value = *read;
}

void Reader::field(std::string_view key, std::string& value, std::string_view,
                   const std::vector<std::string>& choices) {
  YamlMap& map = tree_->levels.back();
  if (!tree_->find_field(key)) return;
  value = (choices.empty() ? map.text(key) : map.choice(key, choices)).value_or(value);
}

void Reader::field(std::string_view key, std::vector<double>& value, std::string_view, Bounds bounds, Length length) {
  YamlMap& map = tree_->levels.back();
  const auto read = tree_->find_field(key) ? map.numbers(key) : std::nullopt;
  if (!read) return;
  if (!fits(*read, length)) return map.add_error(key, length_fault(*read, length));
  for (const double v : *read) {
    if (!inside(v, bounds)) return map.add_error(key, fmt::format("holds {}, must be {}", v, bounds_text(bounds)));
  }
  value = *read;
}

void Reader::renamed(std::string_view old_key, std::string_view key) {
  YamlMap& map = tree_->levels.back();
  const std::string where = tree_->errors.location(map.path(old_key));
  if (!map.rename(old_key, key)) return;
  tree_->warnings.push_back(
      fmt::format("{} is now called {}; the former name is accepted for this version only", where, key));
}

void Reader::former(std::string_view key, double& value, double, std::string_view place, Bounds bounds) {
  YamlMap& map = tree_->levels.back();
  if (!map.has(key)) return;
  tree_->warnings.push_back(fmt::format("{} is now stated as {}; the former key is accepted for this version only",
                                        tree_->errors.location(map.path(key)), place));
  field(key, value, {}, bounds);
}

void Reader::check(std::string_view key, bool good, std::string_view fault) {
  // A command line sets one option at a time, so combinations are checked by validate() in the end.
  if (!good && tree_->errors.has_lines()) tree_->levels.back().add_error(key, std::string(fault));
}

bool Reader::enter(std::string_view key) {
  // A group that the document does not have is entered too: its fields keep their values.
  YamlMap& map = tree_->levels.back();
  tree_->enter(map.optional_node(key).value_or(YamlNode()), map.path(key));
  return true;
}

void Reader::leave() {
  tree_->levels.back().reject_unknown_keys();
  tree_->levels.pop_back();
}

std::optional<std::size_t> Reader::open_list(std::string_view key) {
  YamlMap& map = tree_->levels.back();
  const auto node = map.optional_node(key);
  if (!node) return std::nullopt;
  if (!node->is_list()) {
    map.add_error(key, "must be a list of groups of `key: value` lines");
    return std::nullopt;
  }
  tree_->lists.push_back(*node);
  return node->items().size();
}

bool Reader::enter_item(std::string_view key, std::size_t index) {
  const YamlNode item = tree_->lists.back().items()[index];
  const std::string path = tree_->levels.back().path(fmt::format("{}[{}]", key, index));
  tree_->errors.set_line(path, item.line());
  tree_->levels.emplace_back(item, path, tree_->errors);
  return true;
}

void Reader::close_list() {
  tree_->lists.pop_back();
}

Status Reader::finish() {
  tree_->levels.back().reject_unknown_keys();
  return tree_->errors.status(kOptionsHint);
}

std::vector<std::string> Reader::warnings() const {
  return tree_->warnings;
}

GivenKeys Reader::given() const {
  GivenKeys given;
  for (const std::string& key : tree_->given) given.add(key);
  return given;
}

void Validator::add_error(std::string_view key, std::string_view what) {
  errors_ += fmt::format("{}{}{} {}", errors_.empty() ? "" : "\n", prefix_, key, what);
}
void Validator::field(std::string_view key, const int& value, std::string_view, Bounds bounds) {
  if (!inside(value, bounds)) add_error(key, fmt::format("is {}, must be {}", value, bounds_text(bounds)));
}
void Validator::field(std::string_view key, const double& value, std::string_view, Bounds bounds) {
  if (!std::isfinite(value)) return add_error(key, "must be a finite number");
  if (!inside(value, bounds)) add_error(key, fmt::format("is {}, must be {}", value, bounds_text(bounds)));
}
void Validator::field(std::string_view key, const std::string& value, std::string_view,
                      const std::vector<std::string>& choices) {
  if (choices.empty() || std::find(choices.begin(), choices.end(), value) != choices.end()) return;
  add_error(key, fmt::format("is '{}', must be one of: {}", value, fmt::join(choices, ", ")));
}
void Validator::field(std::string_view key, const std::vector<double>& value, std::string_view, Bounds bounds,
                      Length length) {
  if (!fits(value, length)) return add_error(key, length_fault(value, length));
  for (const double v : value) {
    if (!inside(v, bounds)) return add_error(key, fmt::format("holds {}, must be {}", v, bounds_text(bounds)));
  }
}
Status Validator::finish(std::string_view name) const {
  if (errors_.empty()) return {};
  return failure(ErrorCode::configuration, errors_, std::string(name), kOptionsHint);
}

void Lister::field(std::string_view key, const bool& value, std::string_view meaning) {
  lines.push_back({prefix_ + std::string(key), value ? "true" : "false", std::string(meaning)});
}
void Lister::field(std::string_view key, const int& value, std::string_view meaning, Bounds bounds) {
  lines.push_back({prefix_ + std::string(key), std::to_string(value), with_range(meaning, bounds)});
}
void Lister::field(std::string_view key, const double& value, std::string_view meaning, Bounds bounds) {
  lines.push_back({prefix_ + std::string(key), number(value), with_range(meaning, bounds)});
}
void Lister::field(std::string_view key, const std::string& value, std::string_view meaning,
                   const std::vector<std::string>& choices) {
  std::string text(meaning);
  if (!choices.empty()) text += fmt::format(" ({})", fmt::join(choices, " | "));
  lines.push_back({prefix_ + std::string(key), yaml_quoted(value), text});
}
void Lister::field(std::string_view key, const std::vector<double>& value, std::string_view meaning, Bounds bounds,
                   Length) {
  lines.push_back(
      {prefix_ + std::string(key), fmt::format("[{}]", fmt::join(value, ", ")), with_range(meaning, bounds)});
}

std::string Lister::in_flow_style(const std::vector<OptionLine>& lines) {
  std::string text;
  for (const OptionLine& line : lines) text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", line.key, line.value);
  return "{" + text + "}";
}

Result<std::shared_ptr<Tree>> parse(const std::string& text, const std::string& name) {
  const auto root = parse_yaml(text, name);
  if (!root) return failure(root);
  return std::make_shared<Tree>(name, *root, true);
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
  const auto value = parse_yaml(assignment.substr(equals + 1), name);
  if (!value) return failure(ErrorCode::usage, value.error().what, name);
  // a.b.c=v → {a: {b: {c: v}}}
  std::vector<std::string> keys = split_key(assignment.substr(0, equals));
  std::reverse(keys.begin(), keys.end());
  YamlNode node = *value;
  for (const std::string& key : keys) node = YamlNode::map_of({{YamlNode::text(key), node}});
  return std::make_shared<Tree>(name, node, false);
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

std::string option_location(const std::string& text, const std::string& name, const std::string& key) {
  std::string without_line = fmt::format("{}: {}", name, key);
  const auto root = parse_yaml(text, name);
  if (!root) return without_line;
  YamlNode node = *root;
  int line = 0;
  for (const std::string& part : options_detail::split_key(key)) {
    const std::vector<YamlEntry>& entries = node.entries();
    const auto found = std::find_if(entries.begin(), entries.end(), [&](const YamlEntry& entry) {
      return entry.key.is_scalar() && entry.key.scalar() == part;
    });
    if (found == entries.end()) return without_line;
    line = found->key.line();
    node = YamlNode(found->value);
  }
  return fmt::format("{}:{}: {}", name, line, key);
}

}  // namespace spartan
