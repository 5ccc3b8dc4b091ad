// The "key: number number …" files of KITTI. Internal to rig.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "spartan/core/result.h"

namespace spartan::rig_detail {

/// The lines of such a file. What a key holds is looked at only when it is asked for: other lines may say anything.
class TextMatrices {
 public:
  /// Code `configuration` where the file cannot be read.
  static Result<TextMatrices> read(const std::string& path);
  static TextMatrices parse(const std::string& text, const std::string& name);

  bool has(const std::string& key) const { return lines_.contains(key); }
  /// Exactly `count` finite numbers; otherwise code `configuration` with "file:line" and the key.
  Result<std::vector<double>> numbers(const std::string& key, std::size_t count) const;
  /// "file:line" of a key.
  std::string where(const std::string& key) const;

 private:
  struct Line {
    int number = 0;
    std::string text;
    bool twice = false;
  };
  std::string name_;
  std::map<std::string, Line> lines_;
};

}  // namespace spartan::rig_detail
