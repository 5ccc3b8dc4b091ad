// The matrices and values at the top level of an OpenCV FileStorage file, YAML or XML. Internal to calibration_io.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan::internal {

/// Replaces cv::FileStorage, whose parser reads out of bounds in truncated XML, has no limit of recursion, and does not
/// report line numbers.
class OpencvStorage {
 public:
  /// Code `configuration` if the file cannot be read or is neither YAML nor XML.
  static Result<OpencvStorage> read(const std::string& path);

  bool has(const std::string& key) const { return entries_.contains(key); }
  /// The matrix in row-major order; its number of elements must be one of `counts`.
  Result<std::vector<double>> matrix(const std::string& key, const std::vector<int>& counts) const;
  /// nullopt if the key is missing or not an integer.
  std::optional<int> integer(const std::string& key) const;
  /// A list of two integers.
  std::optional<ImageSize> size(const std::string& key) const;
  /// The first word of the value; empty if the key is missing.
  std::string text(const std::string& key) const;
  /// "key: what" at the key's line, code `configuration`.
  tl::unexpected<Error> error_at(const std::string& key, const std::string& what) const;

  /// A value: its words; for a matrix the words of its data.
  struct Entry {
    int line = 0;
    std::string rows, columns;  ///< of a matrix, as text
    std::vector<std::string> words;
  };

 private:
  std::string name_;
  std::map<std::string, Entry> entries_;
};

/// The entries of an XML file; code `configuration` with "name:line".
Result<std::map<std::string, OpencvStorage::Entry>> parse_opencv_xml(const std::string& text, const std::string& name);

}  // namespace spartan::internal
