#include "spartan/storage/geotiff.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/core/files.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

TEST(GeoTiff, RoundTrips) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/map.tif";
  Image<float> a(37, 21), b(37, 21);
  for (int y = 0; y < 21; ++y) {
    for (int x = 0; x < 37; ++x) {
      a(x, y) = static_cast<float>(0.1 * x - 0.37 * y);
      b(x, y) = x == y ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(x);
    }
  }
  const Status written = write_geotiff(path, {-3.5, 12.25, 0.02}, {{"elevation_m", a.view()}, {"class", b.view()}});
  if (!written && written.error().code == ErrorCode::usage) GTEST_SKIP() << written.error().message();
  ASSERT_TRUE(written) << written.error().message();
  const auto map = read_geotiff(path);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_EQ(map->place.west_m, -3.5);
  EXPECT_EQ(map->place.north_m, 12.25);
  EXPECT_EQ(map->place.cell_m, 0.02);
  EXPECT_EQ(map->names, (std::vector<std::string>{"elevation_m", "class"}));
  for (int y = 0; y < 21; ++y) {
    for (int x = 0; x < 37; ++x) {
      ASSERT_EQ(map->bands[0](x, y), a(x, y));
      ASSERT_TRUE(map->bands[1](x, y) == b(x, y) || (x == y && std::isnan(map->bands[1](x, y))));
    }
  }
  EXPECT_EQ(write_geotiff(folder.path() + "/none/map.tif", {}, {{"a", a.view()}}).error().code, ErrorCode::output);
  ASSERT_TRUE(write_file_atomically(path, "no tiff"));
  EXPECT_EQ(read_geotiff(path).error().code, ErrorCode::input);
}

}  // namespace
}  // namespace spartan
