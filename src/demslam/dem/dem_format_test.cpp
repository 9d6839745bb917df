// The raster formats and coordinate systems that planetary DEMs come in.
#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "demslam/base/error.h"
#include "demslam/dem/dem_reader.h"
#include "demslam/dem/dem_tiles.h"
#include "demslam/dem/geo_track.h"
#include "demslam/dem/reproject.h"
#include "demslam/dem/statistics.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

class DemFormat : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              (std::string("DemFormat.") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    GDALAllRegister();
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// A 4 x 4 raster of the heights 0, 1, 2, ... written by GDAL's own driver.
  fs::path write(const char* driver, const std::string& name, const char* crs, double west = 1000.0,
                 double north = 2000.0, double cell = 10.0) const {
    const fs::path file = folder_ / name;
    const GDALDatasetUniquePtr dataset(
        GetGDALDriverManager()->GetDriverByName(driver)->Create(file.c_str(), 4, 4, 1, GDT_Float32, nullptr));
    EXPECT_TRUE(dataset) << driver;
    std::array<double, 6> g = {west, cell, 0.0, north, 0.0, -cell};
    dataset->SetGeoTransform(g.data());
    OGRSpatialReference reference;
    if (crs != nullptr) {
      EXPECT_EQ(reference.SetFromUserInput(crs), OGRERR_NONE) << crs;
      dataset->SetSpatialRef(&reference);
    }
    std::array<float, 16> heights{};
    for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = static_cast<float>(i);
    EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 4, 4, heights.data(), 4, 4, GDT_Float32, 0, 0),
              CE_None);
    return file;
  }

  fs::path folder_;
};

TEST_F(DemFormat, MoonMarsAndEarthProjectionsGiveLongitudesAndLatitudesOfTheirBody) {
  struct Case {
    const char* crs;
    double west, north, semi_major_m;
  };
  for (const Case& c : {Case{"IAU_2015:30135", 1000.0, 2000.0, 1737400.0},       // Moon, south polar
                        Case{"IAU_2015:30110", 770000.0, 1365000.0, 1737400.0},  // Moon, equirectangular
                        Case{"IAU_2015:49910", 770000.0, 1365000.0, 3396190.0},  // Mars, equirectangular
                        Case{"EPSG:32633", 500000.0, 4177000.0, 6378137.0}}) {   // Etna
    const DemRaster dem = read_dem(write("GTiff", "a.tif", c.crs, c.west, c.north));
    EXPECT_NEAR(semi_major_axis_m(dem.frame), c.semi_major_m, 1e-3) << c.crs;
    const Georeference georeference(dem.frame);
    const Eigen::Vector3d p(15.0, -12.0, 3.0);
    const Eigen::Vector3d back = georeference.map_from_lon_lat_height(georeference.lon_lat_height(p));
    EXPECT_LT((back - p).norm(), 1e-6) << c.crs;
  }
}

TEST_F(DemFormat, EnuGoesToTheMoonsCrsAndBackWithinAMillimetreAt100Km) {
  for (const char* crs : {"IAU_2015:30135", "IAU_2015:30110", "+proj=tmerc +lat_0=45 +lon_0=25 +R=1737400"}) {
    const Georeference georeference(LocalFrame{crs_wkt_of(crs), {20000.0, 30000.0, -1500.0}});
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(1e5, 0.0, 5.0), Eigen::Vector3d(-7.1e4, 7.1e4, -20.0)}) {
      const Eigen::Vector3d back = georeference.map_from_lon_lat_height(georeference.lon_lat_height(p));
      EXPECT_LT((back - p).norm(), 1e-3) << crs;
    }
  }
}

TEST_F(DemFormat, ACutOfAGeographicMapOfMarsIsInMetres) {
  const fs::path file = write("GTiff", "mars.tif", "IAU_2015:49900", 10.0, -4.9, 0.1);
  EXPECT_THAT([&] { read_dem(file); }, ThrowsMessage<Error>(HasSubstr("dem crop --center LON LAT")));
  const DemRaster cut = read_dem_around(file, {.lon_deg = 10.2, .lat_deg = -5.1, .radius_m = 2000.0, .cell_m = 500.0});
  EXPECT_EQ(cut.cols, 8);
  EXPECT_NEAR(*Dem(cut, Interpolation::bilinear).height(0.0, 0.0), 7.5, 0.1);
}

TEST_F(DemFormat, ACutIsTrueToScaleAtTheHeightOfItsTerrain) {
  const fs::path file = write("GTiff", "high.tif", "+proj=utm +zone=33 +datum=WGS84", 500000.0, 4177000.0, 500.0);
  DemRaster high = read_dem(file);
  for (float& height : high.heights) height = 3000.0F;
  write_dem(folder_ / "high.tif", high);
  const Eigen::Vector3d centre = Georeference(high.frame).lon_lat_height(Eigen::Vector3d::Zero());
  const DemRaster cut = read_dem_around(
      folder_ / "high.tif", {.lon_deg = centre.x(), .lat_deg = centre.y(), .radius_m = 500.0, .cell_m = 100.0});
  const Georeference georeference(cut.frame);
  const double north_m = georeference.map_from_lon_lat_height({centre.x(), centre.y() + 0.005, 3000.0}).y();
  EXPECT_NEAR(north_m, 0.005 * M_PI / 180.0 * (6359990.0 + 3000.0), 0.3);  // the meridian's radius there, 37.7 N
}

TEST_F(DemFormat, Pds4ImagesAreReadThroughTheirLabel) {
  write("PDS4", "dem.xml", "+proj=stere +lat_0=-90 +lat_ts=-90 +R=1737400");
  ASSERT_TRUE(fs::exists(folder_ / "dem.img"));
  for (const char* name : {"dem.xml", "dem.img"}) {
    const DemRaster dem = read_dem(folder_ / name);
    EXPECT_FLOAT_EQ(dem.at(1, 2), 6.0F) << name;
    EXPECT_DOUBLE_EQ(dem.cell_m, 10.0);
    EXPECT_NEAR(dem.frame.origin.x(), 1020.0, 1e-6);
    EXPECT_NEAR(semi_major_axis_m(dem.frame), 1737400.0, 1e-6);
  }
}

TEST_F(DemFormat, DegreesThatAreTakenForMetresAreRefused) {
  const fs::path small = write("GTiff", "small.tif", nullptr, 25.6, 45.0, 0.0002);
  EXPECT_THAT([&] { read_dem(small); }, ThrowsMessage<Error>(HasSubstr("look like degrees where metres are meant")));
  const fs::path globe = write("GTiff", "globe.tif", nullptr, -180.0, 90.0, 90.0);
  EXPECT_THAT([&] { read_dem(globe); }, ThrowsMessage<Error>(HasSubstr("look like degrees where metres are meant")));
  const fs::path wrong = write("GTiff", "wrong.tif", "EPSG:32633", 15.0, 37.7, 0.0002);
  EXPECT_THAT([&] { read_dem(wrong); }, ThrowsMessage<Error>(HasSubstr("look like degrees")));
}

TEST_F(DemFormat, ADemWithoutCrsIsReadInMetresButHasNoLongitude) {
  const DemRaster dem = read_dem(write("GTiff", "none.tif", nullptr));
  EXPECT_TRUE(dem.frame.crs_wkt.empty());
  EXPECT_THAT([&] { Georeference{dem.frame}; }, ThrowsMessage<Error>(HasSubstr("carries no CRS")));
  EXPECT_THAT([&] { read_dem_around(folder_ / "none.tif", {}); }, ThrowsMessage<Error>(HasSubstr("no CRS")));
}

TEST_F(DemFormat, AVerticalCrsMeansHeightsAboveTheGeoid) {
  const DemRaster dem = read_dem(write("GTiff", "geoid.tif", "EPSG:32633+5773", 500000.0, 4177000.0));
  EXPECT_EQ(dem.frame.heights, HeightDatum::geoid);
  EXPECT_NEAR(Georeference(dem.frame).lon_lat_height({0.0, 0.0, 7.0}).z(), 7.0, 1e-9);
}

TEST_F(DemFormat, HeightsAreBroughtToTheEllipsoidByStatingTheirDatum) {
  LocalFrame utm = read_dem(write("GTiff", "utm.tif", "EPSG:32633", 500000.0, 4177000.0)).frame;
  utm.origin.z() = 2400.0;
  const LocalFrame lifted = with_heights(utm, HeightDatum::geoid, 43.46);
  EXPECT_EQ(lifted.heights, HeightDatum::ellipsoid);
  EXPECT_DOUBLE_EQ(lifted.origin.z(), 2443.46);
  EXPECT_EQ(with_heights(utm, HeightDatum::geoid, std::nullopt).heights, HeightDatum::geoid);
  EXPECT_THROW(with_heights(utm, HeightDatum::sphere, std::nullopt), Error);
  EXPECT_THROW(with_heights(utm, HeightDatum::radius, std::nullopt), Error);
  EXPECT_THROW(with_heights(utm, HeightDatum::ellipsoid, 43.46), Error);

  const LocalFrame moon{crs_wkt_of("IAU_2015:30135"), {0.0, 0.0, 1737400.0}};
  EXPECT_DOUBLE_EQ(with_heights(moon, HeightDatum::radius, std::nullopt).origin.z(), 0.0);
  EXPECT_EQ(with_heights(moon, HeightDatum::radius, std::nullopt).heights, HeightDatum::sphere);
}

TEST_F(DemFormat, WhatHeightsCountFromTravelsWithTheFile) {
  DemRaster dem = read_dem(write("GTiff", "a.tif", "IAU_2015:30135"));
  EXPECT_EQ(dem.frame.heights, HeightDatum::unstated);
  dem.frame.heights = HeightDatum::sphere;
  write_dem(folder_ / "b.tif", dem);
  EXPECT_EQ(read_dem(folder_ / "b.tif").frame.heights, HeightDatum::sphere);
}

TEST_F(DemFormat, AWindowHoldsTheSameCellsAsTheWhole) {
  const fs::path file = write("GTiff", "a.tif", "IAU_2015:30135");
  const MapWindow window{-5.0, -15.0, 15.0, 5.0};
  const DemRaster part = read_dem(file, window), cropped = crop(read_dem(file), window);
  EXPECT_EQ(part.heights, cropped.heights);
  EXPECT_DOUBLE_EQ(part.west_m, cropped.west_m);
  EXPECT_DOUBLE_EQ(part.north_m, cropped.north_m);
}

TEST_F(DemFormat, TilesAndTheWholeRasterGiveTheSameHeights) {
  DemRaster dem{.rows = 600, .cols = 530, .cell_m = 2.0, .west_m = -530.0, .north_m = 600.0};
  for (int i = 0; i < 600 * 530; ++i) dem.heights.push_back(static_cast<float>(20.0 * std::sin(0.013 * i)));
  dem.at(300, 300) = std::numeric_limits<float>::quiet_NaN();
  write_dem(folder_ / "a.tif", dem);
  const auto tiles = std::make_shared<const DemTiles>(DemReader(folder_ / "a.tif"));
  const Dem whole(read_dem(folder_ / "a.tif")), tiled(tiles);
  EXPECT_EQ(tiles->tiles_read(), 0U);
  for (double x = -540.0; x < 540.0; x += 33.7) {
    for (double y = -610.0; y < 610.0; y += 41.3) ASSERT_EQ(tiled.height(x, y), whole.height(x, y)) << x << " " << y;
  }
  EXPECT_FALSE(tiled.height(72.0, -2.0)) << "beside the hole";
  EXPECT_EQ(tiles->tiles_read(), 9U);
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

TEST_F(DemFormat, ADemOf24000By24000CellsDoesNotLieInMemory) {
  constexpr int kSide = 24000;
  const fs::path file = folder_ / "large.tif";
  {
    const char* const options[] = {"TILED=YES", "SPARSE_OK=TRUE", "COMPRESS=LZW", nullptr};
    const GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        file.c_str(), kSide, kSide, 1, GDT_Float32, const_cast<char**>(options)));
    std::array<double, 6> g = {0.0, 1.0, 0.0, 0.0, 0.0, -1.0};
    dataset->SetGeoTransform(g.data());
    dataset->GetRasterBand(1)->SetNoDataValue(-99999.0);
    std::vector<float> tile(256 * 256, 12.5F);
    for (int i = 0; i < kSide / 256; i += 4) {
      ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, i * 256, i * 256, 256, 256, tile.data(), 256, 256,
                                                    GDT_Float32, 0, 0),
                CE_None);
    }
  }
  const double before_mb = peak_memory_mb();
  const Dem dem = open_dem(file);
  const double middle_m = (4 * 256 + 100) - kSide / 2.0;
  EXPECT_NEAR(dem.height(middle_m, -middle_m).value(), 12.5, 1e-6);
  EXPECT_FALSE(dem.height(middle_m, middle_m));
  EXPECT_EQ(dem.raster().cols, kSide);
  const DemRaster window = read_dem(file, {middle_m, -middle_m - 50.0, middle_m + 50.0, -middle_m});
  EXPECT_FLOAT_EQ(window.at(10, 10), 12.5F);
  EXPECT_LT(peak_memory_mb() - before_mb, 200.0) << "the raster itself has 2.3 GB";
}

TEST_F(DemFormat, AFileInStripsHasTheStatisticsOfTheWhole) {
  DemRaster dem{.rows = 2100, .cols = 2000, .cell_m = 2.0};
  for (int i = 0; i < dem.rows * dem.cols; ++i) dem.heights.push_back(static_cast<float>(10.0 * std::sin(0.001 * i)));
  dem.at(7, 7) = std::numeric_limits<float>::quiet_NaN();
  write_dem(folder_ / "a.tif", dem);
  const DemStatistics strips = statistics(folder_ / "a.tif"), whole = statistics(dem);
  EXPECT_EQ(strips.holes, 1U);
  EXPECT_EQ(strips.cells, whole.cells);
  EXPECT_DOUBLE_EQ(strips.min_m, whole.min_m);
  EXPECT_NEAR(strips.mean_m, whole.mean_m, 1e-9);
  EXPECT_DOUBLE_EQ(strips.slope_median_deg, whole.slope_median_deg);
}

TEST_F(DemFormat, AnUncertaintyRasterGivesSigmaWhereItHasValues) {
  DemRaster heights = read_dem(write("GTiff", "dem.tif", "IAU_2015:30135"));
  heights.frame.origin.z() = 500.0;
  write_dem(folder_ / "dem.tif", heights);
  DemRaster sigma = heights;
  sigma.frame.origin.z() = 0.0;
  for (float& value : sigma.heights) value = 0.3F;
  sigma.at(0, 0) = std::numeric_limits<float>::quiet_NaN();
  write_dem(folder_ / "dem_sigma.tif", sigma);
  EXPECT_EQ(sigma_beside(folder_ / "dem.tif"), folder_ / "dem_sigma.tif");
  const Dem dem = open_dem(folder_ / "dem.tif", folder_ / "dem_sigma.tif");
  EXPECT_NEAR(dem.sigma_m(5.0, -5.0).value(), 0.3, 1e-6);
  EXPECT_FALSE(dem.sigma_m(-14.0, 14.0)) << "a hole";
  EXPECT_FALSE(open_dem(folder_ / "dem.tif").sigma_m(5.0, -5.0));
  write("GTiff", "other.tif", "EPSG:32633", 500000.0, 4177000.0);
  EXPECT_THAT([&] { open_dem(folder_ / "dem.tif", folder_ / "other.tif"); },
              ThrowsMessage<Error>(HasSubstr("has another CRS than")));
}

/// What a program that reads vector layers through OGR, as QGIS does, finds in a track.
struct Layer {
  std::string crs;
  double semi_major_m = 0.0;
  std::vector<Eigen::Vector3d> points;
};

Layer read_layer(const fs::path& file) {
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(file.c_str(), GDAL_OF_VECTOR));
  Layer layer;
  if (!dataset) return layer;
  OGRLayer& features = *dataset->GetLayer(0);
  if (const auto* crs = features.GetSpatialRef()) layer.semi_major_m = crs->GetSemiMajor();
  const OGRFeatureUniquePtr feature(features.GetNextFeature());
  const OGRLineString& line = *feature->GetGeometryRef()->toLineString();
  for (int i = 0; i < line.getNumPoints(); ++i) layer.points.emplace_back(line.getX(i), line.getY(i), line.getZ(i));
  return layer;
}

TEST_F(DemFormat, TracksOpenInProgramsThatReadThroughOgr) {
  const Trajectory track = {{0, Pose()}, {1'000'000'000, Pose(Eigen::Quaterniond::Identity(), {100.0, 50.0, 2.0})}};
  struct Case {
    const char* crs;
    Eigen::Vector3d origin;
    double semi_major_m;
  };
  for (const Case& c : {Case{"IAU_2015:30135", {1000.0, 2000.0, 10.0}, 1737400.0},
                        Case{"+proj=stere +lat_0=90 +R=1737500", {1000.0, 2000.0, 10.0}, 1737500.0},
                        Case{"EPSG:32633", {500000.0, 4177000.0, 10.0}, 6378137.0}}) {
    const LocalFrame frame{crs_wkt_of(c.crs), c.origin};
    const Eigen::Vector3d expected = Georeference(frame).lon_lat_height({100.0, 50.0, 2.0});
    std::ofstream(folder_ / "t.geojson") << geojson_track(track, frame, "t");
    std::ofstream(folder_ / "t.kml") << kml_track(track, frame, "a < b");
    const Layer geojson = read_layer(folder_ / "t.geojson"), kml = read_layer(folder_ / "t.kml");
    ASSERT_EQ(geojson.points.size(), 2U) << c.crs;
    ASSERT_EQ(kml.points.size(), 2U) << c.crs;
    EXPECT_NEAR(geojson.semi_major_m, c.semi_major_m, 1.0) << c.crs;
    EXPECT_LT((geojson.points[1] - expected).norm(), 1e-6);
    EXPECT_LT((kml.points[1] - expected).norm(), 1e-4);
  }
}

}  // namespace
}  // namespace demslam
