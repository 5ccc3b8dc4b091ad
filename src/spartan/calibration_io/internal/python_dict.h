// Parser of Python dict literals {'key': value, …}, the format of mrcal's files. Internal to calibration_io.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "spartan/core/result.h"

namespace spartan::internal {

/// Values are strings, numbers and flat lists of numbers. Nested lists, bytes, None, True and False are skipped but
/// must be well formed. Comments (#) are allowed.
class PythonDict {
 public:
  /// Code `configuration` with "name:line" if the text is not such a dict.
  static Result<PythonDict> parse(std::string_view text, const std::string& name);

  bool has(const std::string& key) const { return entries_.contains(key); }
  Result<std::string> text(const std::string& key) const;
  /// A list of finite numbers; with `count`, exactly that many.
  Result<std::vector<double>> numbers(const std::string& key) const;
  Result<std::vector<double>> numbers(const std::string& key, std::size_t count) const;
  /// "key: what" at the key's line, code `configuration`.
  tl::unexpected<Error> error_at(const std::string& key, const std::string& what) const;

  struct Other {};
  struct Entry {
    int line = 0;
    std::variant<Other, std::string, double, std::vector<double>> value;
  };

 private:
  std::string name_;
  std::map<std::string, Entry> entries_;
};

}  // namespace spartan::internal
