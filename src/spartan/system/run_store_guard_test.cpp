// The store of a run notices that another process wrote to it, or that it was removed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "spartan/system/run_store.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

const RunIdentity kSomeIdentity{"0123", "terrain:\n  every_m: 5\n", "schema: 1\n"};

RunStore::Step step_of_frame(int i) {
  RunStore::Step step;
  FrameRecord& frame = step.frame.emplace();
  frame.frame_id = i;
  frame.pair = "narrow";
  frame.stamp.ns = 1'000'000'000LL * (i + 1);
  frame.status = "tracking";
  frame.has_pose = true;
  return step;
}

Status commit_frame(RunStore& store, int i) {
  return store.commit({step_of_frame(i)},
                      RunStore::Checkpoint{{1, 2, 3}, {i + 1, 0xABCDEF0123456789U + static_cast<std::uint64_t>(i)}});
}

class RunStoreGuard : public ::testing::Test {
 protected:
  RunStore create() { return std::move(*RunStore::create(path_, kSomeIdentity)); }
  RunStore resume() { return std::move(*RunStore::resume(path_, kSomeIdentity)); }

  testing::TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/run.sqlite";
};

TEST_F(RunStoreGuard, StoresThePositionInTheRecording) {
  {
    RunStore store = create();
    EXPECT_FALSE(store.checkpoint().value().has_value());
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(commit_frame(store, i));
  }
  RunStore store = resume();
  const auto checkpoint = store.checkpoint();
  ASSERT_TRUE(checkpoint && *checkpoint);
  EXPECT_EQ((*checkpoint)->source.samples_taken, 3);
  EXPECT_EQ((*checkpoint)->source.content_hash, 0xABCDEF012345678BU);
  ASSERT_TRUE(commit_frame(store, 3)) << "the position of the store is that of the checkpoint";
}

TEST_F(RunStoreGuard, ARowIsNotWrittenTwiceByTwoProcesses) {
  RunStore first = create();
  ASSERT_TRUE(commit_frame(first, 0));
  RunStore second = resume();
  ASSERT_TRUE(commit_frame(second, 1));
  const Status late = commit_frame(first, 1);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::output);
  EXPECT_THAT(late.error().message(), HasSubstr("changed by another process"));
  EXPECT_EQ(first.frames()->size(), 2U);
  ASSERT_TRUE(commit_frame(second, 2));
}

TEST_F(RunStoreGuard, AFrameIsNotWrittenTwiceByTwoProcesses) {
  RunStore first = create();
  ASSERT_TRUE(commit_frame(first, 0));
  RunStore second = resume();
  ASSERT_TRUE(second.commit({step_of_frame(1)}));
  const Status late = first.commit({step_of_frame(1)});
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::output);
}

TEST_F(RunStoreGuard, ARemovedStoreEndsTheRun) {
  RunStore store = create();
  ASSERT_TRUE(commit_frame(store, 0));
  std::filesystem::remove(path_);
  const Status status = commit_frame(store, 1);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::output);
  EXPECT_THAT(status.error().message(), HasSubstr("removed"));
}

}  // namespace
}  // namespace spartan
