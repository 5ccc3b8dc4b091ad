#include "spartan/camera/internal/plugin_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

namespace spartan::internal {
namespace {

void* open_plugin(const char* file, const char* variable) {
  namespace fs = std::filesystem;
  constexpr int kMode = RTLD_NOW | RTLD_LOCAL;
  if (const char* given = std::getenv(variable)) return ::dlopen(given, kMode);
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  // The file that contains this code: the program, or the module of another one (the Python package).
  ::Dl_info module{};
  ::dladdr(reinterpret_cast<const void*>(&open_plugin), &module);
  const fs::path beside = fs::path(module.dli_fname == nullptr ? "" : module.dli_fname).parent_path();
  for (const fs::path& folder : {program, program.parent_path() / "lib" / "spartan", beside / "bin"}) {
    // Where the file is there, its own error is the one to tell.
    if (fs::exists(folder / file, error)) return ::dlopen((folder / file).c_str(), kMode);
  }
  return ::dlopen(file, kMode);
}

}  // namespace

Result<PluginLibrary> PluginLibrary::load(const char* file, const char* variable, const std::string& purpose,
                                          const std::string& hint) {
  PluginLibrary plugin;
  plugin.library_ = open_plugin(file, variable);
  plugin.purpose_ = fmt::format("{} the plugin {}", purpose, file);
  plugin.hint_ = fmt::format("set {} to its path, or {}", variable, hint);
  if (plugin.library_ != nullptr) return plugin;
  const char* const reason = ::dlerror();
  return failure(ErrorCode::configuration,
                 fmt::format("{}: {}", plugin.purpose_, reason == nullptr ? "not found" : reason), "", plugin.hint_);
}

void* PluginLibrary::address_of(const char* name) const {
  return ::dlsym(library_, name);
}

Status PluginLibrary::missing(const char* name) const {
  return failure(ErrorCode::configuration, fmt::format("{}: it has no function {}", purpose_, name), "", hint_);
}

}  // namespace spartan::internal
