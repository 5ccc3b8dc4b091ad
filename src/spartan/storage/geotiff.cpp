#include "spartan/storage/geotiff.h"

#include <limits>
#include <stdexcept>

#ifdef SPARTAN_HAS_GDAL
#include <gdal_priv.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>

#include "spartan/core/files.h"
#endif

namespace spartan {

#ifdef SPARTAN_HAS_GDAL

namespace {

struct CloseDataset {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};

Status write_bands(GDALDataset& dataset, const std::string& path, const std::vector<MapBand>& bands) {
  for (std::size_t i = 0; i < bands.size(); ++i) {
    GDALRasterBand* const band = dataset.GetRasterBand(static_cast<int>(i) + 1);
    const ImageView<const float>& values = bands[i].values;
    band->SetDescription(bands[i].name.c_str());
    band->SetNoDataValue(std::numeric_limits<double>::quiet_NaN());
    // RasterIO takes a void* in both directions; with GF_Write it does not change the data.
    const CPLErr error =
        band->RasterIO(GF_Write, 0, 0, values.width(), values.height(), const_cast<float*>(values.data()),
                       values.width(), values.height(), GDT_Float32, 0,
                       static_cast<GSpacing>(values.stride()) * static_cast<GSpacing>(sizeof(float)), nullptr);
    if (error != CE_None)
      return failure(ErrorCode::output, std::string("cannot be written: ") + CPLGetLastErrorMsg(), path);
  }
  return {};
}

}  // namespace

Status write_geotiff(const std::string& path, const GeoTransform& place, const std::vector<MapBand>& bands) {
  const ImageSize size = bands.empty() ? ImageSize{} : bands.front().values.size();
  for (const MapBand& band : bands) {
    if (band.values.size() != size || size.empty())
      throw std::invalid_argument("write_geotiff: empty bands, or bands of different sizes");
  }
  GDALRegister_GTiff();
  CPLPushErrorHandler(CPLQuietErrorHandler);
  const std::string temporary = temporary_name(path);
  auto written = [&]() -> Status {
    GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    const std::array<const char*, 6> options{"COMPRESS=DEFLATE", "PREDICTOR=3",      "TILED=YES",
                                             "NUM_THREADS=1",    "BIGTIFF=IF_SAFER", nullptr};
    std::unique_ptr<GDALDataset, CloseDataset> dataset(driver->Create(temporary.c_str(), size.width, size.height,
                                                                      static_cast<int>(bands.size()), GDT_Float32,
                                                                      const_cast<char**>(options.data())));
    if (!dataset) return failure(ErrorCode::output, std::string("cannot be written: ") + CPLGetLastErrorMsg(), path);
    std::array<double, 6> transform{place.west_m, place.cell_m, 0, place.north_m, 0, -place.cell_m};
    dataset->SetGeoTransform(transform.data());
    if (Status s = write_bands(*dataset, path, bands); !s) return s;
    CPLErrorReset();
    dataset.reset();  // writes the last blocks: a full disk is reported here
    if (CPLGetLastErrorType() >= CE_Failure)
      return failure(ErrorCode::output, std::string("cannot be written: ") + CPLGetLastErrorMsg(), path);
    return publish_file(temporary, path);
  }();
  CPLPopErrorHandler();
  if (!written) std::remove(temporary.c_str());
  return written;
}

Result<LoadedMap> read_geotiff(const std::string& path) {
  GDALRegister_GTiff();
  CPLPushErrorHandler(CPLQuietErrorHandler);
  auto loaded = [&]() -> Result<LoadedMap> {
    const std::array<const char*, 2> drivers{"GTiff", nullptr};
    const std::unique_ptr<GDALDataset, CloseDataset> dataset(
        GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers.data()));
    std::array<double, 6> transform{};
    if (!dataset || dataset->GetGeoTransform(transform.data()) != CE_None)
      return failure(ErrorCode::input, std::string("is not a GeoTIFF: ") + CPLGetLastErrorMsg(), path);
    LoadedMap map;
    map.place = {transform[0], transform[3], transform[1]};
    for (int i = 1; i <= dataset->GetRasterCount(); ++i) {
      GDALRasterBand* const band = dataset->GetRasterBand(i);
      Image<float> values(dataset->GetRasterXSize(), dataset->GetRasterYSize());
      const CPLErr error = band->RasterIO(
          GF_Read, 0, 0, values.width(), values.height(), values.row(0), values.width(), values.height(), GDT_Float32,
          0, static_cast<GSpacing>(values.view().stride()) * static_cast<GSpacing>(sizeof(float)), nullptr);
      if (error != CE_None)
        return failure(ErrorCode::input, std::string("cannot be read: ") + CPLGetLastErrorMsg(), path);
      map.names.emplace_back(band->GetDescription());
      map.bands.push_back(std::move(values));
    }
    return map;
  }();
  CPLPopErrorHandler();
  return loaded;
}

#else

Status write_geotiff(const std::string& path, const GeoTransform&, const std::vector<MapBand>&) {
  return failure(ErrorCode::usage, "cannot write GeoTIFF: Spartan was built without GDAL", path,
                 "install libgdal-dev and rebuild");
}
Result<LoadedMap> read_geotiff(const std::string& path) {
  return failure(ErrorCode::usage, "cannot read GeoTIFF: Spartan was built without GDAL", path,
                 "install libgdal-dev and rebuild");
}

#endif

}  // namespace spartan
