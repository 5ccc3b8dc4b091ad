#include "spartan/system/run_folder.h"

#include <filesystem>

#include "spartan/core/files.h"

namespace spartan {

Result<FolderState> prepare_run_folder(const RunFolder& folder, bool resume) {
  std::error_code error;
  const bool exists = std::filesystem::exists(folder.path, error);
  if (exists && !std::filesystem::is_directory(folder.path, error)) {
    return failure(ErrorCode::output, "is not a folder", folder.path, "choose another folder with -o");
  }
  if (exists && !resume) {
    return failure(ErrorCode::output, "already exists and is not overwritten", folder.path,
                   "choose another folder with -o, or continue the run with --resume");
  }
  for (const std::string& part : {folder.terrain(), folder.maps()}) {
    if (Status made = make_folder(part); !made) return failure(made);
  }
  return exists ? FolderState::existed : FolderState::created;
}

void remove_run_folder(const RunFolder& folder) {
  std::error_code ignored;
  std::filesystem::remove_all(folder.path, ignored);
}

}  // namespace spartan
