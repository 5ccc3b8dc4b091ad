// A dictionary as Python writes it: {'key': value, …}. mrcal's files are one. Internal to rig.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "spartan/core/result.h"

namespace spartan::rig_detail {

/// The values are texts, numbers and flat lists of numbers; what else stands in the file is passed over, but must be
/// well formed: nested lists, bytes, None. Comments (#) are allowed.
class PythonDict {
 public:
  /// Code `configuration` with "name:line" where the text is no such dictionary.
  static Result<PythonDict> parse(std::string_view text, const std::string& name);

  bool has(const std::string& key) const { return entries_.contains(key); }
  Result<std::string> text(const std::string& key) const;
  /// All numbers of a list; they are finite.
  Result<std::vector<double>> numbers(const std::string& key) const;
  Result<std::vector<double>> numbers(const std::string& key, std::size_t count) const;
  /// "key: what" at the key's line, code `configuration`.
  tl::unexpected<Error> fault(const std::string& key, const std::string& what) const;

  struct Other {};
  struct Entry {
    int line = 0;
    std::variant<Other, std::string, double, std::vector<double>> value;
  };

 private:
  std::string name_;
  std::map<std::string, Entry> entries_;
};

}  // namespace spartan::rig_detail
