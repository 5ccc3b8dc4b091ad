// Parser of the "key: number number …" files of KITTI and the "key = number number …" files of JPL and Ames. Internal
// to rig.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "spartan/core/result.h"

namespace spartan::internal {

/// The lines of such a file. Values are parsed when they are requested; other lines may contain anything.
class TextMatrices {
 public:
  /// A line without a separator, trimmed.
  struct Word {
    int line = 0;
    std::string text;
  };

  /// Code `configuration` if the file cannot be read.
  static Result<TextMatrices> read(const std::string& path, char separator = ':');
  static TextMatrices parse(const std::string& text, const std::string& name, char separator = ':');

  bool has(const std::string& key) const { return lines_.contains(key); }
  /// Exactly `count` finite numbers, optionally followed by a comment (#); otherwise code `configuration` with
  /// "file:line" and the key.
  Result<std::vector<double>> numbers(const std::string& key, std::size_t count) const;
  /// Three finite numbers.
  Result<Eigen::Vector3d> vector(const std::string& key) const;
  /// The text after the separator, trimmed.
  Result<std::string> text(const std::string& key) const;
  /// The lines without a separator, except comments (#) and empty lines.
  const std::vector<Word>& words() const { return words_; }
  /// "file:line" of a key.
  std::string where(const std::string& key) const;
  const std::string& name() const { return name_; }
  /// "key: what" at the key's line, code `configuration`.
  tl::unexpected<Error> error_at(const std::string& key, const std::string& what) const;

 private:
  struct Line {
    int number = 0;
    std::string text;
    bool twice = false;
  };
  std::string name_;
  char separator_ = ':';
  std::map<std::string, Line> lines_;
  std::vector<Word> words_;
};

}  // namespace spartan::internal
