#include "spartan/system/run_folder.h"

#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <utility>

#include "spartan/core/files.h"

namespace spartan {

namespace fs = std::filesystem;

namespace {

tl::unexpected<Error> already_exists(const RunFolder& folder) {
  std::error_code error;
  const bool is_run = fs::exists(folder.store(), error);
  return failure(ErrorCode::output,
                 is_run ? "already exists and is not overwritten" : "already exists, and is not a run", folder.path,
                 is_run ? "choose another folder with -o, continue the run with --resume, or replace it with --force"
                        : "choose another folder with -o");
}

}  // namespace

Status check_run_folder(const RunFolder& folder, bool resume) {
  std::error_code error;
  if (!fs::exists(folder.path, error)) return {};
  if (!fs::is_directory(folder.path, error))
    return failure(ErrorCode::output, "is not a folder", folder.path, "choose another folder with -o");
  if (fs::is_empty(folder.path, error)) return {};
  const auto wait = resume ? FolderLock::kOfKilledProcess : std::chrono::milliseconds(0);
  if (Status free = FolderLock::expect_free(folder.path, wait); !free) return failure(free);
  return resume ? Status() : already_exists(folder);
}

Result<OwnedRunFolder> prepare_run_folder(const RunFolder& folder, bool resume) {
  const fs::path parent = (fs::path(folder.path) / "").parent_path().parent_path();  // also of "path/"
  if (!parent.empty()) {
    if (Status made = make_folder(parent.string()); !made)
      return failure(made.error().code, made.error().what, folder.path, made.error().hint);
  }
  // mkdir: of two processes only one creates the folder.
  const bool created = ::mkdir(folder.path.c_str(), 0777) == 0;
  if (!created && errno != EEXIST) return write_failure(folder.path, errno);
  if (!created) {
    // Waits for another process that has created the folder and is about to lock it.
    if (Status free = resume ? Status() : FolderLock::expect_free(folder.path); !free) return failure(free);
    if (Status usable = check_run_folder(folder, resume); !usable) return failure(usable);
  }
  auto lock =
      resume ? FolderLock::acquire(folder.path, FolderLock::kOfKilledProcess) : FolderLock::acquire(folder.path);
  if (!lock) return failure(lock);
  // Another process with --resume may have been the first to lock the folder that this one created.
  std::error_code error;
  if (!resume && fs::exists(folder.store(), error)) return already_exists(folder);
  if (Status synced = sync_folder(parent.empty() ? "." : parent.string()); !synced) return failure(synced);
  for (const std::string& part : {folder.terrain(), folder.maps()}) {
    if (Status made = make_folder(part); !made) return failure(made);
  }
  for (const std::string& part : {folder.path, folder.terrain(), folder.maps(), folder.report()}) {
    remove_temporary_files(part);
  }
  return OwnedRunFolder{created ? FolderState::created : FolderState::existed, std::move(*lock)};
}

Result<ReplacedFolder> replace_run_folder(const RunFolder& folder) {
  constexpr std::array<std::string_view, 16> kEntries{"run.sqlite",
                                                      "run.sqlite-wal",
                                                      "run.sqlite-shm",
                                                      "config.yaml",
                                                      "rig.yaml",
                                                      "input.yaml",
                                                      "log.txt",
                                                      "summary.json",
                                                      "trajectory_odometry.tum",
                                                      "trajectory_slam.tum",
                                                      "trajectory_localization.tum",
                                                      "trajectory_smoothed.tum",
                                                      "maps",
                                                      "terrain",
                                                      "live",
                                                      "report"};
  std::error_code error;
  if (!fs::exists(folder.store(), error)) return ReplacedFolder();  // prepare_run_folder() tells
  return ReplacedFolder::set_aside(folder.path, kEntries);
}

void remove_run_folder(const RunFolder& folder) {
  std::error_code ignored;
  fs::remove_all(folder.path, ignored);
}

}  // namespace spartan
