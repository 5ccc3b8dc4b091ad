#include "spartan/storage/geotiff.h"

#include <limits>
#include <stdexcept>

#ifdef SPARTAN_HAS_GDAL
#include <fmt/format.h>
#include <gdal_frmts.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>

#include "spartan/core/files.h"
#endif

namespace spartan {

#ifdef SPARTAN_HAS_GDAL

namespace {

struct CloseDataset {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};

// GDAL gives up where small allocations fail, and writes what it has where large ones fail. What it needs (twice the
// image, and its drivers) must therefore be free before it is called.
void expect_memory_for_gdal(ImageSize size, std::size_t bands) {
  constexpr std::size_t kOfDrivers_bytes = std::size_t{8} << 20U;
  const std::size_t bytes = kOfDrivers_bytes + 2 * static_cast<std::size_t>(size.width) *
                                                   static_cast<std::size_t>(size.height) * bands * sizeof(float);
  void* volatile memory = std::malloc(bytes);  // volatile: an unused allocation may otherwise be left out
  if (memory == nullptr) throw std::bad_alloc();
  std::free(memory);
}

// Keeps the first error while it exists: GDALClose() and destructors of GDAL do not return theirs, and the last error
// may be a consequence. A failed allocation leaves GDAL by std::bad_alloc, and what GDAL had allocated is then lost:
// GDAL would call abort() or use a null pointer.
class GdalErrors {
 public:
  GdalErrors() { CPLPushErrorHandlerEx(&GdalErrors::keep, this); }
  ~GdalErrors() { CPLPopErrorHandler(); }
  GdalErrors(const GdalErrors&) = delete;
  GdalErrors& operator=(const GdalErrors&) = delete;
  GdalErrors(GdalErrors&&) = delete;
  GdalErrors& operator=(GdalErrors&&) = delete;

  bool any() const { return number_ != CPLE_None; }
  tl::unexpected<Error> error(ErrorCode code, const char* what, const std::string& path) const {
    return failure(code, what + (any() ? std::string(text_.data()) : "GDAL reports no reason"), path);
  }

 private:
  static void keep(CPLErr severity, CPLErrorNum number, const char* text) {
    if (severity == CE_Fatal || (severity == CE_Failure && number == CPLE_OutOfMemory)) throw std::bad_alloc();
    auto& self = *static_cast<GdalErrors*>(CPLGetErrorHandlerUserData());
    if (severity < CE_Failure || self.any()) return;
    self.number_ = number;
    std::snprintf(self.text_.data(), self.text_.size(), "%s", text);
  }
  CPLErrorNum number_ = CPLE_None;
  std::array<char, 512> text_{};
};

using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

void register_drivers() {
  GDALRegister_GTiff();
  GDALRegister_MEM();
  GDALRegister_COG();
}

// A raster of classes alone: bytes, for which TIFF has colour tables.
bool is_classes(const std::vector<MapBand>& bands) {
  return bands.size() == 1 && !bands.front().categories.empty();
}

// "m2" of "variance_m2".
std::string unit_of(const std::string& name) {
  const std::string unit = name.substr(std::min(name.size(), name.rfind('_') + 1));
  const std::array<const char*, 3> known{"m", "m2", "rad"};
  return std::find(known.begin(), known.end(), unit) == known.end() ? std::string() : unit;
}

bool describe(GDALDataset& dataset, const GeoTransform& place, const MapDescription& description) {
  std::array<double, 6> transform{place.west_m, place.cell_m, 0, place.north_m, 0, -place.cell_m};
  OGRSpatialReference local;
  if (local.SetLocalCS(description.coordinate_system.c_str()) != OGRERR_NONE ||
      local.SetLinearUnits(SRS_UL_METER, 1) != OGRERR_NONE || dataset.SetSpatialRef(&local) != CE_None ||
      dataset.SetGeoTransform(transform.data()) != CE_None) {
    return false;
  }
  return std::all_of(description.items.begin(), description.items.end(), [&](const auto& item) {
    return dataset.SetMetadataItem(item.first.c_str(), item.second.c_str()) == CE_None;
  });
}

bool set_colours(GDALRasterBand& band, const std::vector<MapCategory>& categories) {
  GDALColorTable colours;
  for (std::size_t i = 0; i < categories.size(); ++i) {
    const Rgb8 colour = categories[i].colour;
    const GDALColorEntry entry{colour.r, colour.g, colour.b, 255};
    colours.SetColorEntry(static_cast<int>(i), &entry);
  }
  return band.SetColorTable(&colours) == CE_None;
}

// Lowest, highest, mean, standard deviation and share of the known cells, as `gdalinfo -stats` would compute them.
// GDAL's own function fails on bands without a known cell.
bool set_statistics(GDALRasterBand& band, const ImageView<const float>& values) {
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, sum = 0, squares = 0;
  std::int64_t known = 0;
  const auto each_known = [&values](const auto& visit) {
    for (int y = 0; y < values.height(); ++y) {
      for (int x = 0; x < values.width(); ++x) {
        if (!std::isnan(values(x, y))) visit(static_cast<double>(values(x, y)));
      }
    }
  };
  each_known([&](double value) {
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
    sum += value;
    ++known;
  });
  if (known == 0) return true;
  const double count = static_cast<double>(known), mean = sum / count;
  each_known([&](double value) { squares += (value - mean) * (value - mean); });
  const double percent = 100 * count / (static_cast<double>(values.width()) * values.height());
  return band.SetStatistics(lowest, highest, mean, std::sqrt(squares / count)) == CE_None &&
         band.SetMetadataItem("STATISTICS_VALID_PERCENT", fmt::format("{:.4g}", percent).c_str()) == CE_None;
}

// A dataset of GDAL in memory. Float bands are the values themselves; `classes` are the bytes of a band of classes.
class MapInMemory {
 public:
  MapInMemory(ImageSize size, const std::vector<MapBand>& bands) : size_(size), bands_(&bands) {
    GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName("MEM");
    dataset_.reset(driver->Create("", size.width, size.height, 0, GDT_Float32, nullptr));
    if (is_classes(bands)) classes_ = as_bytes(bands.front().values);
    complete_ = dataset_ != nullptr;
    for (std::size_t i = 0; complete_ && i < bands.size(); ++i) complete_ = add(static_cast<int>(i) + 1, bands[i]);
  }
  bool complete() const { return complete_; }
  GDALDataset& dataset() { return *dataset_; }

 private:
  static Image<std::uint8_t> as_bytes(const ImageView<const float>& values) {
    Image<std::uint8_t> bytes(values.width(), values.height());
    for (int y = 0; y < values.height(); ++y) {
      std::transform(values.row(y), values.row(y) + values.width(), bytes.row(y),
                     [](float value) { return static_cast<std::uint8_t>(std::isnan(value) ? 0.F : value); });
    }
    return bytes;
  }

  // GDAL takes the address of the values as text; it does not change a source of CreateCopy().
  bool add(int number, const MapBand& band) {
    const bool bytes = is_classes(*bands_);
    const void* const address = bytes ? static_cast<const void*>(classes_.row(0)) : band.values.data();
    const std::string at = fmt::format("DATAPOINTER=0x{:x}", reinterpret_cast<std::uintptr_t>(address));
    const auto row_bytes = bytes ? static_cast<std::size_t>(classes_.view().stride())
                                 : static_cast<std::size_t>(band.values.stride()) * sizeof(float);
    const std::string line = fmt::format("LINEOFFSET={}", row_bytes);
    std::array<const char*, 3> options{at.c_str(), line.c_str(), nullptr};
    if (dataset_->AddBand(bytes ? GDT_Byte : GDT_Float32, const_cast<char**>(options.data())) != CE_None) return false;
    GDALRasterBand& added = *dataset_->GetRasterBand(number);
    added.SetDescription(band.name.c_str());
    added.SetUnitType(unit_of(band.name).c_str());
    added.SetNoDataValue(bytes ? 0 : std::numeric_limits<double>::quiet_NaN());
    return bytes ? set_colours(added, band.categories) : set_statistics(added, band.values);
  }

  ImageSize size_;
  const std::vector<MapBand>* bands_;
  Image<std::uint8_t> classes_;
  Dataset dataset_;
  bool complete_ = false;
};

// GDAL keeps names of categories in a file beside a GeoTIFF; empty where there are none.
std::string sidecar_text(const std::vector<MapBand>& bands) {
  std::string text;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    if (bands[i].categories.empty()) continue;
    text += "  <PAMRasterBand band=\"" + std::to_string(i + 1) + "\">\n    <CategoryNames>\n";
    for (const MapCategory& category : bands[i].categories)
      text += "      <Category>" + category.name + "</Category>\n";
    text += "    </CategoryNames>\n  </PAMRasterBand>\n";
  }
  return text.empty() ? text : "<PAMDataset>\n" + text + "</PAMDataset>\n";
}

// The map first; names of categories of a former map do not stay.
Status publish(const std::string& temporary, const std::string& path, const std::vector<MapBand>& bands) {
  if (Status s = publish_file(temporary, path); !s) return s;
  const std::string sidecar = sidecar_text(bands);
  if (!sidecar.empty()) return write_file_atomically(geotiff_sidecar(path), sidecar);
  std::remove(geotiff_sidecar(path).c_str());
  return {};
}

Dataset open_geotiff(const std::string& path) {
  const std::array<const char*, 2> drivers{"GTiff", nullptr};
  return Dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers.data()));
}

// Of the dataset's size; nullopt on errors.
std::optional<Image<float>> read_band(GDALRasterBand& band) {
  Image<float> values(band.GetXSize(), band.GetYSize());
  const CPLErr error = band.RasterIO(
      GF_Read, 0, 0, values.width(), values.height(), values.row(0), values.width(), values.height(), GDT_Float32, 0,
      static_cast<GSpacing>(values.view().stride()) * static_cast<GSpacing>(sizeof(float)), nullptr);
  if (error != CE_None) return std::nullopt;
  return values;
}

bool same_values(const ImageView<const float>& a, const ImageView<const float>& b, bool nan_is_0) {
  const auto same = [nan_is_0](float x, float y) {
    return x == y || (std::isnan(y) && (nan_is_0 ? x == 0 : std::isnan(x)));
  };
  for (int y = 0; y < a.height(); ++y) {
    if (!std::equal(a.row(y), a.row(y) + a.width(), b.row(y), same)) return false;
  }
  return true;
}

// libtiff reports no error where the row buffer of its predictor cannot be allocated, and writes elevations of 1e37 m.
// Only what can be read again was written.
bool holds(const std::string& path, const std::vector<MapBand>& bands) {
  const Dataset dataset = open_geotiff(path);
  for (std::size_t i = 0; dataset && i < bands.size(); ++i) {
    const auto values = read_band(*dataset->GetRasterBand(static_cast<int>(i) + 1));
    if (!values || !same_values(values->view(), bands[i].values, is_classes(bands))) return false;
  }
  return dataset != nullptr;
}

}  // namespace

Status write_geotiff(const std::string& path, const GeoTransform& place, const std::vector<MapBand>& bands,
                     const MapDescription& description) {
  const ImageSize size = bands.empty() ? ImageSize{} : bands.front().values.size();
  for (const MapBand& band : bands) {
    if (band.values.size() != size || size.empty())
      throw std::invalid_argument("write_geotiff: empty bands, or bands of different sizes");
  }
  expect_memory_for_gdal(size, bands.size());
  GdalErrors errors;  // not const: the error handler of GDAL writes to it
  register_drivers();
  const std::string temporary = temporary_name(path);
  MapInMemory map(size, bands);
  if (map.complete() && describe(map.dataset(), place, description)) {
    GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName("COG");
    const std::array<const char*, 8> options{"COMPRESS=DEFLATE",
                                             is_classes(bands) ? "PREDICTOR=NO" : "PREDICTOR=FLOATING_POINT",
                                             "NUM_THREADS=1",
                                             "BIGTIFF=IF_SAFER",
                                             "BLOCKSIZE=512",
                                             "OVERVIEW_RESAMPLING=NEAREST",
                                             "OVERVIEW_COMPRESS=DEFLATE",
                                             nullptr};
    Dataset written(
        driver->CreateCopy(temporary.c_str(), &map.dataset(), 0, const_cast<char**>(options.data()), nullptr, nullptr));
    const bool complete = written != nullptr;
    written.reset();  // writes the last blocks: a full disk is reported here
    if (complete && !errors.any() && holds(temporary, bands)) return publish(temporary, path, bands);
  }
  std::remove(temporary.c_str());
  std::remove((temporary + ".ovr.tmp").c_str());  // overviews before they are put into the file
  return errors.error(ErrorCode::output, "cannot be written: ", path);
}

Result<LoadedMap> read_geotiff(const std::string& path) {
  GdalErrors errors;  // not const: the error handler of GDAL writes to it
  register_drivers();
  const Dataset dataset = open_geotiff(path);
  std::array<double, 6> transform{};
  if (!dataset || dataset->GetGeoTransform(transform.data()) != CE_None)
    return errors.error(ErrorCode::input, "is not a GeoTIFF: ", path);
  LoadedMap map;
  map.place = {transform[0], transform[3], transform[1]};
  for (int i = 1; i <= dataset->GetRasterCount(); ++i) {
    GDALRasterBand* const band = dataset->GetRasterBand(i);
    auto values = read_band(*band);
    if (!values) return errors.error(ErrorCode::input, "cannot be read: ", path);
    map.names.emplace_back(band->GetDescription());
    map.bands.push_back(std::move(*values));
  }
  return map;
}

#else

Status write_geotiff(const std::string& path, const GeoTransform&, const std::vector<MapBand>&, const MapDescription&) {
  return failure(ErrorCode::usage, "cannot write GeoTIFF: Spartan was built without GDAL", path,
                 "install libgdal-dev and rebuild");
}
Result<LoadedMap> read_geotiff(const std::string& path) {
  return failure(ErrorCode::usage, "cannot read GeoTIFF: Spartan was built without GDAL", path,
                 "install libgdal-dev and rebuild");
}

#endif

std::string geotiff_sidecar(const std::string& path) {
  return path + ".aux.xml";
}

}  // namespace spartan
