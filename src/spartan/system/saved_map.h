// Opens a global map for reading: a map file, or the map of a run.
#pragma once

#include <memory>
#include <string>

#include "spartan/core/result.h"
#include "spartan/slam/map_file.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// Read-only access to a saved global map.
class SavedMap {
 public:
  /// `path`: a map file or a run folder. Codes: `input` (missing, damaged, or without a map), `configuration` (of
  /// another version).
  static Result<SavedMap> open(const std::string& path);

  GlobalMap& map() { return file_ ? file_->map() : *run_map_; }
  /// Options of the run; the defaults for a map file.
  const RunOptions& options() const { return options_; }

 private:
  explicit SavedMap(RunOptions options) : options_(std::move(options)) {}
  static Result<SavedMap> open_run(const std::string& path);

  RunOptions options_;
  std::unique_ptr<MapFile> file_;
  std::unique_ptr<RunStore> run_store_;
  std::unique_ptr<GlobalMap> run_map_;
};

}  // namespace spartan
