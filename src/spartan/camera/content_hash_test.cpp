#include "spartan/camera/internal/content_hash.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "spartan/camera/recording.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::unique_ptr<Recording> open_tiny(const TemporaryFolder& folder) {
  auto source = open_recording(folder.path());
  EXPECT_TRUE(source) << source.error().message();
  return std::move(*source);
}

// After the first `samples` samples, by next() or by seek().
std::uint64_t hash_after(const TemporaryFolder& folder, int samples) {
  const auto source = open_tiny(folder);
  for (int i = 0; i < samples; ++i) EXPECT_TRUE(source->next());
  const auto other = open_tiny(folder);
  EXPECT_TRUE(other->seek(samples));
  EXPECT_EQ(other->content_hash(), source->content_hash()) << "read and passed over";
  return source->content_hash();
}

std::string tiny_image_path(const TemporaryFolder& folder, int camera, int i) {
  return folder.path() + "/image_" + std::to_string(camera) + "/00000" + std::to_string(i) + ".png";
}

TEST(ContentHash, TellsContentsApart) {
  using internal::ContentHash;
  const auto of = [](std::initializer_list<std::string_view> parts) {
    ContentHash hash;
    for (const std::string_view part : parts) hash.add(part);
    return hash.value();
  };
  EXPECT_EQ(of({"abcdefgh", "i"}), of({"abcdefgh", "i"}));
  EXPECT_NE(of({"abcdefgh", "i"}), of({"abcdefghi"})) << "the parts are told apart";
  EXPECT_NE(of({"a"}), of({std::string_view("a\0", 2)})) << "and so is the padding";
  EXPECT_NE(of({""}), of({"", ""}));
  std::string text(1000, 'x');
  const std::uint64_t before = of({text});
  for (const std::size_t at : {0U, 7U, 8U, 500U, 999U}) {
    std::string changed = text;
    changed[at] = 'y';
    EXPECT_NE(of({changed}), before) << at;
  }
}

TEST(ContentHash, CoversTheImagesThatWereTaken) {
  const TemporaryFolder folder;
  testing::write_tiny_kitti(folder, 6);
  const std::uint64_t before = hash_after(folder, 4);
  testing::write_tiny_png(tiny_image_path(folder, 1, 5), 99);
  EXPECT_EQ(hash_after(folder, 4), before) << "not yet taken";
  testing::write_tiny_png(tiny_image_path(folder, 1, 2), 99);
  EXPECT_NE(hash_after(folder, 4), before);
}

TEST(ContentHash, IsTheSameForAFrameThatVanishedDuringTheRun) {
  const TemporaryFolder folder;
  testing::write_tiny_kitti(folder, 6);
  const auto source = open_tiny(folder);
  fs::remove(tiny_image_path(folder, 1, 2));  // after the recording was opened
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(source->next());
  EXPECT_EQ(source->content_hash(), hash_after(folder, 4));
}

TEST(ContentHash, IsTheSameForADamagedFrame) {
  const TemporaryFolder folder;
  testing::write_tiny_kitti(folder, 6);
  std::ofstream(tiny_image_path(folder, 0, 2)) << "damaged";
  EXPECT_NE(hash_after(folder, 4), 0U) << "hash_after() compares";
}

TEST(ContentHash, CoversSensorSamples) {
  const TemporaryFolder folder;
  testing::write_tiny_spartan(folder, 3);
  const std::string header = "stamp_ns,left_m,right_m\n";
  folder.write("sensors/wheels.csv", header + "1,0.5,0.5\n2,0.6,0.6\n3,0.7,0.7\n");
  const std::uint64_t before = hash_after(folder, 3);
  folder.write("sensors/wheels.csv", header + "1,0.5,0.5\n2,0.6,0.61\n3,0.7,0.7\n");
  EXPECT_NE(hash_after(folder, 3), before);
  folder.write("sensors/wheels.csv", header + "1,0.5,0.5\n3,0.7,0.7\n");
  EXPECT_NE(hash_after(folder, 3), before);
}

TEST(ListingHash, IsOfTheListAndNotOfThePlace) {
  const auto hash_of = [](int frames, const std::string& with, const std::string& what) {
    const TemporaryFolder folder;
    testing::write_tiny_spartan(folder, frames);
    std::string text = testing::content_of(folder.path() + "/frames.csv");
    if (!what.empty()) text.replace(text.rfind(what), what.size(), with);
    folder.write("frames.csv", text);
    return open_tiny(folder)->listing_hash().value();
  };
  const std::uint64_t before = hash_of(3, "", "");
  EXPECT_EQ(hash_of(3, "", ""), before) << "another folder";
  EXPECT_NE(hash_of(4, "", ""), before);
  EXPECT_NE(hash_of(3, "_other.png", "_right.png"), before) << "another image in the last row";
}

TEST(ListingHash, CoversSensorTablesThatAreNotYetRead) {
  const std::string header = "stamp_ns,left_m,right_m\n";
  const auto hash_of = [&](const std::string& table) {
    const TemporaryFolder folder;
    testing::write_tiny_spartan(folder, 3);
    if (!table.empty()) folder.write("sensors/wheels.csv", table);
    return open_tiny(folder)->listing_hash().value();
  };
  const std::uint64_t before = hash_of(header + "1,0.5,0.5\n9000000000,0.6,0.6\n");
  EXPECT_EQ(hash_of(header + "1,0.5,0.5\n9000000000,0.6,0.6\n"), before) << "another folder";
  EXPECT_NE(hash_of(header + "1,0.5,0.5\n"), before) << "one row shorter";
  EXPECT_NE(hash_of(header + "1,0.5,0.5\n9000000000,0.6,0.7\n"), before) << "another value, of the same length";
  EXPECT_NE(hash_of(""), before) << "removed";
}

TEST(UnreadableFiles, AFrameThatCannotBeReadIsTakenByTheNextCall) {
  const TemporaryFolder folder;
  testing::write_tiny_kitti(folder, 3);
  const std::string file = tiny_image_path(folder, 0, 1), original = testing::content_of(file);
  fs::remove(file);
  fs::create_symlink("/proc/self/mem", file);  // a regular file; read() answers with EIO
  const auto source = open_tiny(folder);
  ASSERT_TRUE(source->next());
  for (int attempt = 0; attempt < 2; ++attempt) {
    const auto failed = source->next();
    ASSERT_FALSE(failed) << "not a damaged frame";
    EXPECT_EQ(failed.error().code, ErrorCode::read_error);
    EXPECT_THAT(failed.error().message(), HasSubstr(file));
  }
  EXPECT_FALSE(open_tiny(folder)->seek(2));
  fs::remove(file);
  std::ofstream(file, std::ios::binary) << original;
  const auto sample = source->next();
  ASSERT_TRUE(sample) << sample.error().message();
  const auto* frame = std::get_if<StereoFrame>(&**sample);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->frame_id, 1);
}

TEST(UnreadableRows, AreLeftOutAndCounted) {
  const TemporaryFolder folder;
  testing::write_tiny_spartan(folder, 2);
  folder.write("sensors/wheels.csv", "stamp_ns,left_m,right_m\n1,0.5,0.5\n2,nan,0.6\n3,0.7\n4,0.8,0.8\n5,0.9,0.");
  const auto source = open_tiny(folder);
  const auto samples = testing::collect_samples(*source);
  EXPECT_EQ(samples.error, "");
  EXPECT_EQ(samples.all.size(), 4U) << "two rows of the wheels and two frames";
  const DiscardedSamples rows = source->discarded();
  EXPECT_EQ(rows.unreadable, 3);
  EXPECT_THAT(rows.first_unreadable, HasSubstr("wheels.csv:3: 'nan' is not a finite number"));
}

TEST(FilesOutsideOfTheRecording, AreRejected) {
  for (const std::string name : {"../left.png", "/etc/passwd", "images/../../left.png"}) {
    const TemporaryFolder folder;
    testing::write_tiny_spartan(folder, 2);
    const std::string table = folder.path() + "/frames.csv";
    std::string text = testing::content_of(table);
    const std::size_t begin = text.find("images/stereo");
    text.replace(begin, text.find(',', begin) - begin, name);
    std::ofstream(table) << text;
    const auto source = open_recording(folder.path());
    ASSERT_FALSE(source) << name;
    EXPECT_EQ(source.error().code, ErrorCode::input);
    EXPECT_THAT(source.error().message(), HasSubstr("frames.csv:2: left (outside of the recording) is '" + name));
  }
}

}  // namespace
}  // namespace spartan
