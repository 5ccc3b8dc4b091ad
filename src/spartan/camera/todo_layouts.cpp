#include "spartan/camera/recording_index.h"
namespace spartan {
Result<RecordingIndex> index_kitti_raw(const LayoutChoice& l, const OpenOptions&) {
  return failure(ErrorCode::input, "not read yet", l.folder);
}
Result<RecordingIndex> index_euroc(const LayoutChoice& l, const OpenOptions&) {
  return failure(ErrorCode::input, "not read yet", l.folder);
}
Result<RecordingIndex> index_spartan(const LayoutChoice& l, const OpenOptions&) {
  return failure(ErrorCode::input, "not read yet", l.folder);
}
}  // namespace spartan
