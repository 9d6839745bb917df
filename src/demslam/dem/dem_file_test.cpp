#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "demslam/base/error.h"
#include "demslam/dem/dem.h"
#include "demslam/dem/local_frame.h"
#include "demslam/dem/reproject.h"
#include "demslam/dem/statistics.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

class DemFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

class RealDem : public testing::Test {
 protected:
  static fs::path file_or_skip(const std::string& name) {
    fs::path file = fs::path(DEMSLAM_SHARED_DIR) / "data" / name;
    return fs::exists(file) ? file : fs::path();
  }
};
#define REQUIRE_FILE(variable, name)                     \
  const fs::path variable = RealDem::file_or_skip(name); \
  if (variable.empty()) GTEST_SKIP() << "reference data missing: " << name

DemRaster small_dem() {
  DemRaster dem{.rows = 3, .cols = 4, .cell_m = 2.0, .west_m = -1.0, .north_m = 5.0};
  for (int i = 0; i < 12; ++i) dem.heights.push_back(static_cast<float>(0.25 * i));
  dem.at(1, 2) = std::nanf("");
  dem.frame.origin = {1000.0, 2000.0, 50.0};
  return dem;
}

/// A GeoTIFF written with GDAL itself; `point`: tie point at the first cell's centre, as "point" files have it.
void write_geotiff(const fs::path& file, const std::array<double, 6>& placement, bool point, const char* crs) {
  GDALAllRegister();
  CPLSetConfigOption("GTIFF_POINT_GEO_IGNORE", point ? "TRUE" : "FALSE");
  auto* const dataset =
      GetGDALDriverManager()->GetDriverByName("GTiff")->Create(file.c_str(), 2, 2, 1, GDT_Int16, nullptr);
  std::array<double, 6> g = placement;
  if (point) dataset->SetMetadataItem("AREA_OR_POINT", "Point");
  dataset->SetGeoTransform(g.data());
  OGRSpatialReference reference;
  if (crs != nullptr && reference.SetFromUserInput(crs) == OGRERR_NONE) dataset->SetSpatialRef(&reference);
  dataset->GetRasterBand(1)->SetScale(0.5);
  dataset->GetRasterBand(1)->SetOffset(10.0);
  std::array<std::int16_t, 4> values = {2, 4, 6, 8};
  EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 2, 2, values.data(), 2, 2, GDT_Int16, 0, 0), CE_None);
  GDALClose(dataset);
  CPLSetConfigOption("GTIFF_POINT_GEO_IGNORE", nullptr);
}

constexpr const char* kMoonMetres = "+proj=stere +lat_0=-90 +R=1737400 +units=m";
constexpr std::array<double, 6> kNorthUp = {100.0, 5.0, 0.0, 200.0, 0.0, -5.0};

TEST_F(DemFile, IsReadBackAsItWasWritten) {
  const DemRaster dem = small_dem();
  write_dem(folder_ / "a.tif", dem);
  const DemRaster back = read_dem(folder_ / "a.tif", dem.frame.origin);
  EXPECT_EQ(back.rows, 3);
  EXPECT_EQ(back.cols, 4);
  EXPECT_DOUBLE_EQ(back.west_m, dem.west_m);
  EXPECT_DOUBLE_EQ(back.north_m, dem.north_m);
  EXPECT_TRUE(std::isnan(back.at(1, 2)));
  EXPECT_FLOAT_EQ(back.at(2, 3), dem.at(2, 3));
  EXPECT_FALSE(fs::exists(folder_ / "a.tif.part"));
}

TEST_F(DemFile, HonoursScaleOffsetAndCornerRegistration) {
  write_geotiff(folder_ / "area.tif", kNorthUp, false, kMoonMetres);
  const DemRaster dem = read_dem(folder_ / "area.tif", Eigen::Vector3d::Zero());
  EXPECT_FLOAT_EQ(dem.at(0, 0), 11.0F);
  EXPECT_TRUE(dem.centre(0, 0).isApprox(Eigen::Vector2d(102.5, 197.5)));
}

TEST_F(DemFile, HonoursPointRegistration) {
  write_geotiff(folder_ / "point.tif", kNorthUp, true, kMoonMetres);
  EXPECT_TRUE(
      read_dem(folder_ / "point.tif", Eigen::Vector3d::Zero()).centre(0, 0).isApprox(Eigen::Vector2d(100.0, 200.0)));
}

TEST_F(DemFile, MapOriginIsTheCentreByDefault) {
  write_geotiff(folder_ / "a.tif", kNorthUp, false, kMoonMetres);
  const DemRaster dem = read_dem(folder_ / "a.tif");
  EXPECT_TRUE(dem.frame.origin.isApprox(Eigen::Vector3d(105.0, 195.0, 10.0)));
  EXPECT_DOUBLE_EQ(dem.west_m, -5.0);
  EXPECT_FLOAT_EQ(dem.at(0, 0), 1.0F);
}

TEST_F(DemFile, CarriesItsMapOriginAlong) {
  write_dem(folder_ / "a.tif", small_dem());
  const DemRaster read = read_dem(folder_ / "a.tif");
  EXPECT_EQ(read.frame.origin, small_dem().frame.origin);
  EXPECT_EQ(read.west_m, -1.0);
}

TEST_F(DemFile, RefusesWhatIsNotSquareMetresNorthUp) {
  const auto refusal = [&](const std::array<double, 6>& placement, const char* crs) -> std::string {
    write_geotiff(folder_ / "bad.tif", placement, false, crs);
    try {
      read_dem(folder_ / "bad.tif");
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal({100, 5, 1, 200, 1, -5}, kMoonMetres), testing::HasSubstr("rotated"));
  EXPECT_THAT(refusal({100, 5, 0, 200, 0, 5}, kMoonMetres), testing::HasSubstr("north-up"));
  EXPECT_THAT(refusal({100, 5, 0, 200, 0, -4}, kMoonMetres), testing::HasSubstr("not square"));
  EXPECT_THAT(refusal({10, 0.5, 0, 20, 0, -0.5}, "+proj=longlat +R=1737400"), testing::HasSubstr("degrees"));
  EXPECT_THAT(refusal(kNorthUp, "+proj=stere +lat_0=-90 +R=1737400 +units=km"), testing::HasSubstr("metres"));
}

TEST_F(DemFile, RefusesMissingAndForeignFiles) {
  std::ofstream(folder_ / "text.tif") << "not a raster";
  for (const char* name : {"absent.tif", "text.tif"}) {
    EXPECT_THAT([&] { read_dem(folder_ / name); }, testing::ThrowsMessage<Error>(testing::HasSubstr(name)));
  }
}

TEST_F(DemFile, WritingIntoAMissingFolderIsAnError) {
  EXPECT_THROW(write_dem(folder_ / "none" / "a.tif", small_dem()), Error);
}

TEST_F(DemFile, AFullDiskLeavesNothingBehindAndTheOldFileUntouched) {
  write_dem(folder_ / "a.tif", small_dem());
  DemRaster large{.rows = 400, .cols = 400, .cell_m = 1.0};
  for (int i = 0; i < 160000; ++i) large.heights.push_back(static_cast<float>(std::sin(i * 0.7)));
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit tight{20000, before.rlim_max};
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &tight);
  EXPECT_THROW(write_dem(folder_ / "a.tif", large), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_FALSE(fs::exists(folder_ / "a.tif.part"));
  EXPECT_EQ(read_dem(folder_ / "a.tif").cols, 4);
}

/// Corners from the tags of the TIFF files, extremes from their publishers; metres.
struct KnownDem {
  const char* name;
  int cols, rows;
  double cell_m, west_m, north_m, min_m, max_m, hole_fraction;
};

TEST_F(RealDem, CornersExtremesAndHolesAreThoseOfTheFiles) {
  for (const KnownDem& known :
       {KnownDem{"polar_stereographic_33x33.tif", 33, 33, 2.4266098484848486, -53750.0, -51050.0, -212.29616,
                 -205.44009, 0.0},
        KnownDem{"nac_pit_1m4.tif", 985, 1181, 1.4055739268770893, 42.87000476975122, 564.3379316411514, -2190.91016,
                 -1978.33594, 0.05716},
        KnownDem{"nac_pit_5m.tif", 279, 333, 5.0, 37.5, 567.5, -2190.91016, -1978.93555, 0.05128}}) {
    REQUIRE_FILE(file, std::string("lunar_dtm/") + known.name);
    const DemRaster dem = read_dem(file);
    const DemStatistics s = statistics(dem);
    EXPECT_EQ(dem.cols, known.cols) << known.name;
    EXPECT_EQ(dem.rows, known.rows) << known.name;
    EXPECT_DOUBLE_EQ(dem.cell_m, known.cell_m);
    EXPECT_NEAR(dem.frame.origin.x() + dem.west_m, known.west_m, 1e-9);
    EXPECT_NEAR(dem.frame.origin.y() + dem.north_m, known.north_m, 1e-9);
    EXPECT_NEAR(s.min_m, known.min_m, 1e-4);
    EXPECT_NEAR(s.max_m, known.max_m, 1e-4);
    EXPECT_NEAR(s.hole_fraction(), known.hole_fraction, 1e-4);
    EXPECT_NEAR(semi_major_axis_m(dem.frame), 1737400.0, 1e-6);
  }
}

TEST_F(RealDem, NacTerrainHasItsSlopes) {
  REQUIRE_FILE(file, "lunar_dtm/nac_pit_1m4.tif");
  EXPECT_NEAR(statistics(file).slope_median_deg, 4.8, 0.1);
}

TEST_F(RealDem, NacTerrainLiesWhereItWasMapped) {
  REQUIRE_FILE(file, "lunar_dtm/nac_pit_5m.tif");
  const Georeference georeference(read_dem(file).frame);
  const Eigen::Vector3d centre = georeference.lon_lat_height(Eigen::Vector3d::Zero());
  EXPECT_NEAR(centre.x(), 25.61, 0.05);
  EXPECT_NEAR(centre.y(), 44.96, 0.05);
}

TEST_F(RealDem, PlanetaryRadiiBecomeHeightsAboveTheReferenceSphere) {
  for (const char* name : {"pds3/LDEM_4.LBL", "pds3/LDEM_4.IMG"}) {
    REQUIRE_FILE(file, name);
    const DemRaster dem = read_dem(file);
    EXPECT_EQ(dem.cols, 1440);
    EXPECT_EQ(dem.rows, 720);
    EXPECT_NEAR(dem.frame.origin.x() + dem.west_m, -720 * 7580.84, 1e-3) << "the label's scale and offsets";
    EXPECT_NEAR(dem.frame.origin.y() + dem.north_m, 360 * 7580.84, 1e-3);
    const MapWindow extent = dem.extent();
    const Eigen::Vector3d south_west =
        Georeference(dem.frame).lon_lat_height({extent.west_m + 10.0, extent.south_m + 10.0, 0.0});
    EXPECT_NEAR(south_west.x(), 0.0, 1e-3) << "the label's westernmost longitude";
    EXPECT_NEAR(south_west.y(), -90.0, 1e-3);
    EXPECT_DOUBLE_EQ(dem.frame.origin.z(), 1737400.0);
    const auto [low, high] = std::minmax_element(dem.heights.begin(), dem.heights.end());
    EXPECT_NEAR(*low, -0.5 * 17757, 1e-3);  // the file's own extreme values, halved
    EXPECT_NEAR(*high, 0.5 * 21008, 1e-3);
    EXPECT_DOUBLE_EQ(with_heights(dem.frame, HeightDatum::radius, std::nullopt).origin.z(), 0.0);
  }
}

TEST_F(RealDem, AGlobalMapIsCutAndReprojectedAroundAPoint) {
  REQUIRE_FILE(label, "pds3/LDEM_4.LBL");
  const DemRaster dem =
      read_dem_around(label, {.lon_deg = 25.6, .lat_deg = 45.0, .radius_m = 40000.0, .cell_m = 4000.0});
  EXPECT_EQ(dem.rows, 20);
  const Georeference georeference(dem.frame);
  EXPECT_LT((georeference.map_from_lon_lat_height({25.6, 45.0, 1737400.0})).norm(), 1e-6);
  const DemRaster global = read_dem(label);
  const Eigen::Vector3d p = Georeference(global.frame).map_from_lon_lat_height({25.6, 45.0, 1737400.0});
  EXPECT_NEAR(*Dem(dem).height(0.0, 0.0), *Dem(global).height(p.x(), p.y()), 150.0);
  EXPECT_THROW(read_dem_around(label, {.radius_m = 0.0}), Error);
}

TEST_F(RealDem, AwkwardFilesAreReadOrRefusedInOneLine) {
  struct Refused {
    const char *name, *reason;
  };
  for (const Refused& refused :
       {Refused{"dem_nodata.dem", "cells are not square"}, Refused{"dem_portrait.tif", "the DEM is in degrees"},
        Refused{"dem_unfinished.tif", "the DEM is in degrees"}}) {
    REQUIRE_FILE(file, std::string("lunar_dtm/") + refused.name);
    EXPECT_THAT([&] { read_dem(file); }, testing::ThrowsMessage<Error>(testing::AllOf(
                                             testing::HasSubstr(refused.name), testing::HasSubstr(refused.reason),
                                             testing::Not(testing::HasSubstr("\n")))));
  }
}

TEST_F(RealDem, NoDataThatIsNanStaysHoles) {
  REQUIRE_FILE(file, "lunar_dtm/dem_nodata_nan.nc");
  const DemStatistics s = statistics(read_dem(file));
  EXPECT_EQ(s.cells, 53U * 75U);
  EXPECT_EQ(s.holes, 103U);
  EXPECT_NEAR(s.min_m, 682.0, 1e-3);
  EXPECT_NEAR(s.max_m, 2932.0, 1e-3);
}

TEST_F(RealDem, DegreesAreCutAndReprojected) {
  REQUIRE_FILE(file, "lunar_dtm/dem_portrait.tif");
  const DemRaster dem =
      read_dem_around(file, {.lon_deg = -122.5, .lat_deg = 37.5, .radius_m = 5000.0, .cell_m = 500.0});
  EXPECT_EQ(dem.cols, 20);
  EXPECT_LT(statistics(dem).hole_fraction(), 1.0);
}

LocalFrame moon_frame() {
  OGRSpatialReference crs;
  crs.SetFromUserInput(kMoonMetres);
  char* wkt = nullptr;
  crs.exportToWkt(&wkt);
  LocalFrame frame{.crs_wkt = wkt, .origin = {120000.0, -40000.0, 15.0}};
  CPLFree(wkt);
  return frame;
}

TEST(Georeference, GoesToTheMoonAndBackWithinAMillimetreAt100Km) {
  const Georeference georeference(moon_frame());
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(1e5, 0, 3), Eigen::Vector3d(-7e4, 7e4, -20), Eigen::Vector3d(0, -1e5, 0)}) {
    EXPECT_LT((georeference.map_from_lon_lat_height(georeference.lon_lat_height(p)) - p).norm(), 1e-3);
  }
}

TEST(Georeference, KnowsThePoleOfAPolarProjection) {
  const Georeference georeference(moon_frame());
  const Eigen::Vector3d pole = georeference.lon_lat_height({-120000.0, 40000.0, 0.0});
  EXPECT_NEAR(pole.y(), -90.0, 1e-9);
  EXPECT_DOUBLE_EQ(pole.z(), 15.0);
}

TEST(Georeference, NeedsACrs) { EXPECT_THROW(Georeference{LocalFrame{}}, Error); }

}  // namespace
}  // namespace demslam
