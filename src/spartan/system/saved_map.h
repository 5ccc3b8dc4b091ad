// A global map on the disk, to look at: a map file, or the map of a run.
#pragma once

#include <memory>
#include <string>

#include "spartan/core/result.h"
#include "spartan/slam/map_file.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan {

class SavedMap {
 public:
  /// `path`: a map file or a run folder; it is only read. Codes: `input` (missing, damaged, no map in it),
  /// `configuration` (of another version).
  static Result<SavedMap> open(const std::string& path);

  GlobalMap& map() { return file_ ? file_->map() : *of_run_; }
  /// As the run had them; the defaults for a map file.
  const RunOptions& options() const { return options_; }

 private:
  explicit SavedMap(RunOptions options) : options_(std::move(options)) {}
  static Result<SavedMap> open_run(const std::string& path);

  RunOptions options_;
  std::unique_ptr<MapFile> file_;
  std::unique_ptr<RunStore> run_;
  std::unique_ptr<GlobalMap> of_run_;
};

}  // namespace spartan
