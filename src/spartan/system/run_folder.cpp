#include "spartan/system/run_folder.h"

#include <sys/stat.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "spartan/core/files.h"

namespace spartan {

namespace fs = std::filesystem;

Result<OwnedRunFolder> prepare_run_folder(const RunFolder& folder, bool resume) {
  const fs::path parent = (fs::path(folder.path) / "").parent_path().parent_path();  // also of "path/"
  if (!parent.empty()) {
    if (Status made = make_folder(parent.string()); !made)
      return failure(made.error().code, made.error().what, folder.path, made.error().hint);
  }
  // mkdir: of two processes only one creates the folder.
  const bool created = ::mkdir(folder.path.c_str(), 0777) == 0;
  if (!created && errno != EEXIST) return write_failure(folder.path, errno);
  std::error_code error;
  if (!created && !fs::is_directory(folder.path, error)) {
    return failure(ErrorCode::output, "is not a folder", folder.path, "choose another folder with -o");
  }
  const auto exists = [&] {
    return failure(ErrorCode::output, "already exists and is not overwritten", folder.path,
                   "choose another folder with -o, continue the run with --resume, or replace it with --force");
  };
  if (!created && !resume) {
    if (Status free = FolderLock::expect_free(folder.path); !free) return failure(free);
    return exists();
  }
  auto lock = FolderLock::acquire(folder.path);
  if (!lock) return failure(lock);
  // Another process with --resume may have been the first to lock the folder that this one created.
  if (!resume && fs::exists(folder.store(), error)) return exists();
  if (Status synced = sync_folder(parent.empty() ? "." : parent.string()); !synced) return failure(synced);
  for (const std::string& part : {folder.terrain(), folder.maps()}) {
    if (Status made = make_folder(part); !made) return failure(made);
  }
  for (const std::string& part : {folder.path, folder.terrain(), folder.maps(), folder.report()}) {
    remove_temporary_files(part);
  }
  return OwnedRunFolder{created ? FolderState::created : FolderState::existed, std::move(*lock)};
}

Status replace_run_folder(const RunFolder& folder) {
  std::error_code error;
  if (!fs::exists(folder.store(), error)) return {};
  if (Status free = FolderLock::expect_free(folder.path); !free) return free;
  fs::remove_all(folder.path, error);
  if (!error) return {};
  return failure(ErrorCode::output, "cannot be removed: " + error.message(), folder.path);
}

void remove_run_folder(const RunFolder& folder) {
  std::error_code ignored;
  fs::remove_all(folder.path, ignored);
}

}  // namespace spartan
