// The matrices and values at the top of an OpenCV file storage, YAML or XML. Internal to rig.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan::rig_detail {

/// Not cv::FileStorage: its parser reads behind the end of XML that was cut off, recurses as deep as a file likes, and
/// does not tell lines.
class OpencvStorage {
 public:
  /// Code `configuration` where the file cannot be read or is neither YAML nor XML.
  static Result<OpencvStorage> read(const std::string& path);

  bool has(const std::string& key) const { return entries_.contains(key); }
  /// The matrix as doubles, row by row, with one of `counts` of elements.
  Result<std::vector<double>> matrix(const std::string& key, const std::vector<int>& counts) const;
  std::optional<int> integer(const std::string& key) const;
  /// Two whole numbers in a list.
  std::optional<ImageSize> size(const std::string& key) const;
  /// Empty where the key is missing or no text.
  std::string text(const std::string& key) const;
  /// "key: what" at the key's line, code `configuration`.
  tl::unexpected<Error> fault(const std::string& key, const std::string& what) const;

  /// A value: its words, of a matrix those of its data.
  struct Entry {
    int line = 0;
    std::string rows, columns;  ///< of a matrix
    std::vector<std::string> words;
  };

 private:
  std::string name_;
  std::map<std::string, Entry> entries_;
};

/// The entries of a file in XML; code `configuration` with "name:line".
Result<std::map<std::string, OpencvStorage::Entry>> parse_opencv_xml(const std::string& text, const std::string& name);

}  // namespace spartan::rig_detail
