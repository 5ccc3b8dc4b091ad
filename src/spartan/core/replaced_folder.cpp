#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "spartan/core/files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

// Names that any folder of the program may have beside its own.
bool is_temporary(const std::string& name) {
  return name == "owner.lock" || name.ends_with(".part");
}

// Whether `folder` is the current one, or around it: it cannot be made again under its name.
bool holds_current_folder(const fs::path& folder) {
  std::error_code error;
  const fs::path current = fs::current_path(error);
  return !error && std::mismatch(folder.begin(), folder.end(), current.begin(), current.end()).first == folder.end();
}

tl::unexpected<Error> not_replaced(const std::string& path, const std::string& why) {
  return failure(ErrorCode::output, why + ": it is not replaced", path, "choose another folder with -o");
}

}  // namespace

Result<ReplacedFolder> ReplacedFolder::set_aside(const std::string& path, std::span<const std::string_view> known) {
  const std::string name_alone = path.substr(0, std::max<std::size_t>(1, path.find_last_not_of('/') + 1));
  std::error_code error;
  if (fs::is_symlink(name_alone, error)) return not_replaced(path, "is a link");
  if (!fs::exists(path, error)) return ReplacedFolder();
  if (!fs::is_directory(path, error)) return not_replaced(path, "is not a folder");
  const auto entries = list_folder(path);
  if (!entries) return failure(ErrorCode::output, entries.error().what, path);
  if (entries->empty()) return ReplacedFolder();
  for (const std::string& name : *entries) {
    if (std::find(known.begin(), known.end(), name) == known.end() && !is_temporary(name))
      return not_replaced(path, "holds '" + name + "', which is not of this command");
  }
  const fs::path folder = fs::canonical(path, error);
  if (error) return not_replaced(path, "cannot be found: " + error.message());
  if (holds_current_folder(folder)) return not_replaced(path, "is the current folder, or one around it");
  if (Status free = FolderLock::expect_free(path); !free) return failure(free);
  const std::string aside = folder.string() + "." + std::to_string(::getpid()) + ".replaced";
  fs::rename(folder, aside, error);
  if (error) return not_replaced(path, "cannot be renamed: " + error.message());
  ReplacedFolder replaced(folder.string(), aside);
  // A process that has found the folder by its former name holds the lock by now.
  if (const auto lock = FolderLock::acquire(aside); !lock) return failure(lock);
  return replaced;
}

ReplacedFolder::ReplacedFolder(ReplacedFolder&& other) noexcept
    : path_(std::move(other.path_)), aside_(std::exchange(other.aside_, {})) {}

ReplacedFolder& ReplacedFolder::operator=(ReplacedFolder&& other) noexcept {
  if (this != &other) {
    restore();
    path_ = std::move(other.path_);
    aside_ = std::exchange(other.aside_, {});
  }
  return *this;
}

ReplacedFolder::~ReplacedFolder() {
  restore();
}

void ReplacedFolder::discard() {
  std::error_code ignored;
  if (!aside_.empty()) fs::remove_all(aside_, ignored);
  aside_.clear();
}

void ReplacedFolder::restore() {
  if (aside_.empty()) return;
  std::error_code error;
  fs::remove_all(path_, error);
  if (!error) fs::rename(aside_, path_, error);
  aside_.clear();
}

}  // namespace spartan
