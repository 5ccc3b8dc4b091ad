// What recordings of streams state.
#include "spartan/camera/recording_writer.h"

namespace spartan {

RecordingOptions recording_options_of(const StreamInfo& info) {
  RecordingOptions options;
  options.name = info.name;
  options.description = info.description;
  options.noise = info.noise;
  if (info.gravity_m_s2) options.gravity_m_s2 = *info.gravity_m_s2;
  return options;
}

}  // namespace spartan
