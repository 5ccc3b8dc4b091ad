// Libraries of Spartan that are loaded only where they are needed, because of what they link.
#pragma once

#include <string>

#include "spartan/core/result.h"

namespace spartan::internal {

/// A loaded plugin. It stays loaded: what it links does not support unloading.
class PluginLibrary {
 public:
  /// Loads `file`: from the path in the environment variable `variable`, else beside the program (a build folder), else
  /// in its library path. Code `configuration`: there is none; the message begins with `purpose`.
  static Result<PluginLibrary> load(const char* file, const char* variable, const std::string& purpose,
                                    const std::string& hint);

  /// Code `configuration`: the plugin has no such function.
  template <class Function>
  Status find(const char* name, Function& function) const {
    void* const symbol = address_of(name);
    if (symbol == nullptr) return missing(name);
    function = reinterpret_cast<Function>(symbol);
    return {};
  }

 private:
  void* address_of(const char* name) const;
  Status missing(const char* name) const;
  void* library_ = nullptr;
  std::string purpose_, hint_;
};

}  // namespace spartan::internal
