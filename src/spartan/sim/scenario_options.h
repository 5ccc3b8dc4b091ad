// Options of a scenario (scenario.yaml): world, drive and ground truth, one struct per group of keys.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "spartan/core/options.h"

namespace spartan::sim {

// --- World ---

/// Shape of the ground without rocks. Relief is fractal: octaves of gradient noise from `relief_size_m` down to 2 cm,
/// whose amplitudes fall by the factor `relief_gain` from each octave to the next one of half the wavelength (0.5:
/// self-similar, Hurst exponent 1). Ripples and dunes are wave trains with meandering crests. Cavities are round pits
/// with walls of fixed steepness. A crater is a paraboloid inside its rim and an ejecta apron outside, which falls
/// with the cube of the distance.
struct TerrainShapeOptions {
  double relief_m = 0.06;           ///< m; standard deviation of the height
  double relief_size_m = 8;         ///< m; longest wavelength
  double relief_gain = 0.42;        ///< amplitude ratio of successive octaves
  double slope_deg = 0;             ///< deg; overall inclination
  double slope_heading_deg = 0;     ///< deg; uphill direction, counter-clockwise from x
  double ripple_height_m = 0.008;   ///< m; crest to trough
  double ripple_length_m = 0.14;    ///< m; crest to crest
  double ripple_heading_deg = -26;  ///< deg; across the crests, counter-clockwise from x
  double ripple_wander_rad = 1.8;   ///< rad; standard deviation of the phase over six lengths
  double dune_height_m = 0.1;       ///< m; crest to trough
  double dune_length_m = 7;         ///< m; crest to crest
  double cavities_per_100m2 = 0;    ///< 1/(100 m²)
  double cavity_diameter_m = 0.6;   ///< m; largest cavity
  double cavity_depth_m = 0.25;     ///< m; largest cavity
  double crater_radius_m = 0;       ///< m; centre to rim crest; 0: no crater
  double crater_rim_m = 1;          ///< m; rim crest above the plain
  double crater_depth_m = 2;        ///< m; floor below the plain
  double crater_x_m = 0;            ///< m; centre, world x
  double crater_y_m = 0;            ///< m; centre, world y

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("relief_m", relief_m,
            "Standard deviation of the fractal relief in metres; raising it makes the ground rougher at every scale.",
            between(0, 5));
    v.field("relief_size_m", relief_size_m,
            "Longest wavelength of the fractal relief in metres; raising it gives broader hills.", between(0.1, 200));
    v.field("relief_gain", relief_gain,
            "Amplitude of an octave of the relief over that of the next longer one; raising it gives more fine detail "
            "(0.5 is self-similar).",
            between(0.2, 0.9));
    v.field("slope_deg", slope_deg, "Inclination of the whole terrain in degrees.", between(0, 30));
    v.field("slope_heading_deg", slope_heading_deg,
            "Uphill direction of the whole terrain in degrees, counter-clockwise from the world's x axis.");
    v.field("ripple_height_m", ripple_height_m, "Crest-to-trough height of the wind ripples in metres; 0 for none.",
            between(0, 0.1));
    v.field("ripple_length_m", ripple_length_m, "Crest-to-crest length of the wind ripples in metres.",
            between(0.05, 2));
    v.field("ripple_heading_deg", ripple_heading_deg,
            "Direction across the crests of the ripples in degrees, counter-clockwise from the world's x axis.");
    v.field("ripple_wander_rad", ripple_wander_rad,
            "Standard deviation of the phase of the ripples in radians; raising it makes their length and direction "
            "vary more.",
            between(0, 20));
    v.field("dune_height_m", dune_height_m, "Crest-to-trough height of the dunes in metres; 0 for none.",
            between(0, 5));
    v.field("dune_length_m", dune_length_m, "Crest-to-crest length of the dunes in metres.", between(1, 100));
    v.field("cavities_per_100m2", cavities_per_100m2,
            "Mean number of cavities (negative obstacles) on 100 square metres; 0 for none.", between(0, 200));
    v.field("cavity_diameter_m", cavity_diameter_m,
            "Diameter of the largest cavities in metres; the smallest have half of it.", between(0.1, 5));
    v.field("cavity_depth_m", cavity_depth_m, "Depth of the largest cavities in metres; the smallest have half of it.",
            between(0, 3));
    v.field("crater_radius_m", crater_radius_m,
            "Radius of a single large crater in metres, from its centre to the rim crest; 0 for none.",
            between(0, 200));
    v.field("crater_rim_m", crater_rim_m, "Height of the crater's rim crest above the plain in metres.",
            between(0, 50));
    v.field("crater_depth_m", crater_depth_m, "Depth of the crater's floor below the plain in metres.",
            between(0, 100));
    v.field("crater_x_m", crater_x_m, "World x coordinate of the crater's centre in metres.");
    v.field("crater_y_m", crater_y_m, "World y coordinate of the crater's centre in metres.");
  }
};

/// Sizes follow Golombek & Rapp, "Size-frequency distributions of rocks on Mars" (JGR 1997): rocks of diameter D and
/// more cover the fraction F(D) = k exp(−q D) of the ground, q = 1.79 + 0.152/k, D in metres.
struct RockFieldOptions {
  double coverage = 0.07;       ///< k of the model, fraction of the area
  double smallest_m = 0.01;     ///< m; smallest diameter
  double largest_m = 2.5;       ///< m; largest diameter
  double height_ratio = 0.5;    ///< mean height over diameter
  double pebbles_per_m2 = 300;  ///< 1/m²; pebbles of 4 to 10 mm besides the model
  double buried_fraction = 0;   ///< fraction of the rocks of which only the top shows
  double layered_fraction = 0;  ///< fraction of the rocks with layers that stand out

  template <class Visitor>
  void describe(Visitor& v) {
    v.renamed("share", "coverage");
    v.field("coverage", coverage,
            "Fraction of the ground that rocks of all sizes cover (k of Golombek and Rapp, 1997); raising it gives "
            "more and larger rocks.",
            between(0, 0.3));
    v.field("smallest_m", smallest_m, "Diameter of the smallest rocks of the model in metres.", between(0.003, 1));
    v.field("largest_m", largest_m, "Diameter of the largest rocks in metres.", between(0.01, 5));
    v.check("largest_m", largest_m > smallest_m, "must be greater than smallest_m");
    v.field("pebbles_per_m2", pebbles_per_m2,
            "Number of pebbles of 4 to 10 mm diameter on a square metre, in addition to the rocks of the model.",
            between(0, 5000));
    v.field("height_ratio", height_ratio, "Mean height of a rock above the ground over its diameter.", between(0.1, 1));
    v.field("buried_fraction", buried_fraction,
            "Fraction of the rocks that are buried in the ground by more than half; these are lower.", between(0, 1));
    v.field("layered_fraction", layered_fraction,
            "Fraction of the rocks that have layers, of which each stands out over the one below.", between(0, 1));
  }
};

/// Albedo is fixed to the world. Its variation is a sum of gradient noise from 2.4 m down to 0.3 mm; detail finer than
/// the footprint of a pixel is filtered out.
/// Scattering: Lunar–Lambert (McEwen, Icarus 1991), a mean of the Lommel–Seeliger and Lambert laws with weight L:
///   r = albedo (2 L μ₀ / (μ₀ + μ) + (1 − L) μ₀), μ₀ and μ the cosines of incidence and emission.
struct SoilOptions {
  double albedo = 0.2;             ///< mean albedo of the soil
  double contrast = 0.14;          ///< standard deviation of the albedo over its mean
  double octave_gain = 1.15;       ///< amplitude ratio of successive octaves of the albedo
  double contrast_spread = 0;      ///< standard deviation of the logarithm of the contrast between places
  double contrast_size_m = 1.5;    ///< m; size of these places
  double rock_albedo_ratio = 0.8;  ///< mean albedo of rocks over that of the soil
  double lunar_weight = 0.5;       ///< L of the Lunar–Lambert law

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("albedo", albedo, "Mean albedo of the soil.", between(0.02, 0.9));
    v.field("contrast", contrast,
            "Standard deviation of the albedo over its mean, all scales together; raising it gives more texture.",
            between(0, 0.6));
    v.renamed("grain", "octave_gain");
    v.field("octave_gain", octave_gain,
            "Amplitude of an octave of the albedo over that of the next longer one; raising it moves contrast to "
            "finer scales.",
            between(0.5, 1.5));
    v.field("contrast_spread", contrast_spread,
            "Standard deviation of the natural logarithm of the contrast between places; raising it gives more places "
            "without texture beside others that have more.",
            between(0, 3));
    v.field("contrast_size_m", contrast_size_m, "Size in metres of the places that differ in contrast.",
            between(0.1, 100));
    v.field("rock_albedo_ratio", rock_albedo_ratio, "Mean albedo of the rocks over that of the soil.", between(0.1, 3));
    v.field("lunar_weight", lunar_weight,
            "Weight L of the Lunar-Lambert scattering law: 0 is Lambert, 1 is Lommel-Seeliger.", between(0, 1));
  }
};

/// Flat polygonal plates on the soil.
struct SlabOptions {
  double cover = 0;     ///< fraction of the area
  double size_m = 0.5;  ///< m; mean spacing of the plates
  double height_m = 0;  ///< m; mean height of their tops above the soil; single ones differ by up to half of it

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("cover", cover, "Fraction of the ground that is covered by plates.", between(0, 1));
    v.field("size_m", size_m, "Mean size of the plates in metres.", between(0.05, 5));
    v.field("height_m", height_m, "Mean height of the tops of the plates above the soil in metres.", between(0, 0.3));
  }
};

/// Smooth drifts of fine dust, which bury pebbles and texture.
struct DustOptions {
  double cover = 0;             ///< fraction of the area
  double size_m = 2;            ///< m; wavelength of the drifts
  double depth_m = 0.01;        ///< m
  double albedo_ratio = 1.4;    ///< mean albedo over that of the soil
  double contrast_ratio = 0.2;  ///< contrast over that of the soil

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("cover", cover, "Fraction of the ground that is covered by drifts of dust.", between(0, 1));
    v.field("size_m", size_m, "Size of the drifts in metres.", between(0.1, 50));
    v.field("depth_m", depth_m, "Depth of the dust in metres; lower rocks disappear in it.", between(0, 0.3));
    v.field("albedo_ratio", albedo_ratio, "Mean albedo of the dust over that of the soil.", between(0.2, 4));
    v.field("contrast_ratio", contrast_ratio, "Contrast of the dust over that of the soil.", between(0, 1));
  }
};

/// What covers the soil.
struct GroundCoverOptions {
  SlabOptions bedrock{0, 0.5, 0.03};  ///< slabs of bedrock
  SlabOptions crust{0, 0.12, 0.004};  ///< plates of hardened soil
  DustOptions dust;

  template <class Visitor>
  void describe(Visitor& v) {
    v.group("bedrock", bedrock);
    v.group("crust", crust);
    v.group("dust", dust);
  }
};

/// Illuminances in lux.
struct LightOptions {
  double sun_lux = 20000;          ///< lx; direct sun, on a plane normal to it
  double sun_elevation_deg = 45;   ///< deg; above the horizon
  double sun_azimuth_deg = 70;     ///< deg; counter-clockwise from x
  double sun_diameter_deg = 0.35;  ///< deg; angular diameter
  double sky_lux = 6000;           ///< lx; whole sky, on a horizontal plane

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("sun_lux", sun_lux, "Illuminance by the direct sun in lux, on a plane normal to it; 0 is overcast.",
            between(0, 200000));
    v.field("sun_elevation_deg", sun_elevation_deg,
            "Elevation of the sun above the horizon in degrees; lowering it gives longer shadows.", between(1, 90));
    v.field("sun_azimuth_deg", sun_azimuth_deg,
            "Azimuth of the sun in degrees, counter-clockwise from the world's x axis.");
    v.field("sun_diameter_deg", sun_diameter_deg,
            "Angular diameter of the sun in degrees; raising it gives softer shadows.", between(0, 5));
    v.field("sky_lux", sky_lux, "Illuminance by the whole sky in lux, on a horizontal plane.", between(0, 100000));
    v.check("sky_lux", sun_lux > 0 || sky_lux > 0, "is 0, and so is sun_lux; at least one must be positive");
  }
};

// --- Drive ---

enum class PathKind { straight, arc, winding, waypoints, loop, square_spiral, turn_in_place, stationary };
constexpr auto enum_names(PathKind) {
  using enum PathKind;
  return std::array{EnumName{straight, "straight"},
                    EnumName{arc, "arc"},
                    EnumName{winding, "winding"},
                    EnumName{waypoints, "waypoints"},
                    EnumName{loop, "loop"},
                    EnumName{square_spiral, "square_spiral"},
                    EnumName{turn_in_place, "turn_in_place"},
                    EnumName{stationary, "standing"}};
}

/// Path of the body in the world plane. Paths begin at the world's origin, heading along x.
struct PathOptions {
  PathKind kind = PathKind::straight;
  double length_m = 15;                  ///< m; straight, arc, winding, loop
  double turn_deg = 90;                  ///< deg; arc, turn_in_place; positive to the left
  double swing_deg = 20;                 ///< deg; winding: amplitude of the heading
  double wavelength_m = 8;               ///< m; winding
  std::vector<double> waypoints_m = {};  ///< m; waypoints: x, y, x, y …
  double leg_m = 1;                      ///< m; square_spiral: first leg
  double growth_m = 0.5;                 ///< m; square_spiral: added per leg
  int legs = 8;                          ///< square_spiral
  double stationary_s = 30;              ///< s; standing
  double speed_m_s = 0.06;               ///< m/s
  double turn_rate_deg_s = 5;            ///< deg/s; turns in place
  double ramp_s = 2;                     ///< s; acceleration and deceleration
  double end_after_m = 0;                ///< m; the drive ends after this distance; 0: at the end of the path
  double initial_stop_s = 2;             ///< s; at rest before the drive, as gravity is measured there

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("kind", kind, "Shape of the path; the keys below say for which shapes they are used.");
    v.field("length_m", length_m, "Length of a straight, arc, winding or loop path in metres.", between(0.1, 20000));
    v.field("turn_deg", turn_deg, "Change of heading over an arc or a turn_in_place in degrees, positive to the left.",
            between(-3600, 3600));
    v.field("swing_deg", swing_deg, "Amplitude of the heading of a winding path in degrees.", between(0, 80));
    v.field("wavelength_m", wavelength_m, "Wavelength of a winding path in metres.", between(0.5, 1000));
    v.field("waypoints_m", waypoints_m,
            "World coordinates x, y, x, y ... in metres of the waypoints after the start, joined by a cubic spline.");
    v.field("leg_m", leg_m, "Length of the first leg of a square_spiral in metres.", between(0.1, 1000));
    v.field("growth_m", growth_m, "Length in metres that each leg of a square_spiral is longer than the one before.",
            between(0, 1000));
    v.field("legs", legs, "Number of legs of a square_spiral.", between(1, 1000));
    v.renamed("standing_s", "stationary_s");
    v.field("stationary_s", stationary_s, "Duration of a drive of kind standing in seconds.", between(0.1, 100000));
    v.field("speed_m_s", speed_m_s, "Driving speed in metres per second; raising it adds motion blur.",
            between(0.001, 5));
    v.field("turn_rate_deg_s", turn_rate_deg_s, "Rate of turns in place in degrees per second.", between(0.1, 180));
    v.field("end_after_m", end_after_m,
            "Distance in metres after which the drive ends before the end of its path; 0 drives all of it.",
            between(0, 20000));
    v.field("initial_stop_s", initial_stop_s,
            "Time in seconds at rest at the start; filters level themselves in it. 0 begins with the first frame.",
            between(0, 1000));
    v.field("ramp_s", ramp_s, "Time in seconds to accelerate to full speed, and to stop from it.", between(0.1, 60));
  }
};

/// When odometry pairs take frames, and where the rover stops for panoramas.
struct CaptureOptions {
  double frame_step_m = 0.1;                    ///< m; between odometry frames
  double frame_turn_deg = 4;                    ///< deg; between odometry frames, turning in place
  double frame_period_s = 1;                    ///< s; between odometry frames, stationary
  double stop_every_m = 0;                      ///< m; 0: no regular stops
  std::vector<double> stops_m = {};             ///< m; further stops
  std::vector<double> pans_deg = {-35, 0, 35};  ///< deg; positive to the left
  double pan_period_s = 2;                      ///< s; from pan to pan

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("frame_step_m", frame_step_m, "Distance in metres between frames of the odometry pairs.",
            between(0.005, 100));
    v.field("frame_turn_deg", frame_turn_deg,
            "Angle in degrees between frames of the odometry pairs while the rover turns in place.", between(0.1, 90));
    v.field("frame_period_s", frame_period_s,
            "Time in seconds between frames of the odometry pairs where the path is stationary.", between(0.01, 1000));
    v.field("stop_every_m", stop_every_m,
            "Distance in metres between stops with panoramas, the first at the start; 0 for no regular stops.",
            between(0, 10000));
    v.check("stop_every_m", stop_every_m == 0 || stop_every_m >= 0.05, "must be 0 or at least 0.05 m");
    v.field("stops_m", stops_m, "Distances in metres along the path of further stops with panoramas.", at_least(0));
    v.field("pans_deg", pans_deg, "Pan angles of a panorama in degrees, positive to the left.", between(-180, 180));
    v.renamed("seconds_a_pan", "pan_period_s");
    v.field("pan_period_s", pan_period_s, "Time in seconds from one pan of a panorama to the next.",
            between(0.1, 1000));
  }
};

/// Where rocks are removed from the rover's way: the whole width of the rover, or what wheels and body need.
enum class CorridorKind { full, wheels };
constexpr auto enum_names(CorridorKind) {
  return std::array{EnumName{CorridorKind::full, "full"}, EnumName{CorridorKind::wheels, "wheels"}};
}

/// Geometry of the four-wheeled rover.
struct ChassisOptions {
  double wheelbase_m = 0.7;     ///< m; front to rear axle
  double track_m = 0.6;         ///< m; left to right wheel
  double wheel_radius_m = 0.1;  ///< m
  double wheel_width_m = 0.08;  ///< m
  double clearance_m = 0.05;    ///< m; height of rocks that wheels can climb
  CorridorKind corridor = CorridorKind::full;
  double body_clearance_m = 0.2;  ///< m; height of rocks that the body passes over; for corridor `wheels`
  bool visible = false;           ///< the rover and its shadow in the images
  double track_depth_m = 0;       ///< m; of the tracks of its wheels

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("wheelbase_m", wheelbase_m, "Distance from the front to the rear axle in metres.", between(0.05, 10));
    v.field("track_m", track_m, "Distance from the left to the right wheels in metres.", between(0.05, 10));
    v.field("wheel_radius_m", wheel_radius_m,
            "Wheel radius in metres; a wheel rests on the mean height of the ground over a disc of this radius.",
            between(0.01, 2));
    v.field("wheel_width_m", wheel_width_m, "Width of a wheel in metres; wider wheels climb more rocks.",
            between(0.005, 2));
    v.field("clearance_m", clearance_m,
            "Height of rocks in metres above which they are removed from the rover's path; wheels climb lower ones.",
            between(0, 5));
    v.field(
        "corridor", corridor,
        "Where rocks are removed: full clears the whole width of the rover; wheels clears the tracks of the wheels, "
        "and between them only rocks higher than body_clearance_m.");
    v.field("body_clearance_m", body_clearance_m,
            "Height in metres of rocks that the rover drives over between its wheels, where corridor is wheels.",
            between(0, 5));
    v.field("visible", visible,
            "Whether the cameras see the rover (deck, wheels, suspension, masts, camera housings) and its shadow.");
    v.field(
        "track_depth_m", track_depth_m,
        "Depth in metres of the tracks that the wheels leave, as far as the rover has driven when it enters a scene "
        "of 2 m; the true maps are of the ground before the drive.",
        between(0, 0.1));
  }
};

// --- Live simulation ---

/// When images arrive in a live simulation (`sim:SCENARIO`); a recording has all of them.
struct ArrivalOptions {
  double delay_ms = 30;  ///< ms; after the middle of the exposure
  double jitter_ms = 5;  ///< ms; standard deviation of the delay, which varies upwards only

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("delay_ms", delay_ms,
            "Shortest time in milliseconds from the middle of an exposure to the arrival of the image, in a live "
            "simulation.",
            between(0, 10000));
    v.field("jitter_ms", jitter_ms,
            "Standard deviation in milliseconds of the normal distribution whose absolute values are added to delay_ms "
            "for each frame.",
            between(0, 10000));
  }
};

// --- Ground truth ---

/// What ground truth is written.
struct TruthOptions {
  bool disparity = true;
  double cell_m = 0.02;     ///< m
  double obstacle_m = 0.1;  ///< m; above the ground without rocks and cavities
  double cavity_m = 0.1;    ///< m; below the ground without cavities

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("disparity", disparity, "Whether to write the true disparity image and its mask of every frame.");
    v.field("cell_m", cell_m, "Cell size of elevation.tif and obstacles.tif in metres.", between(0.005, 1));
    v.field("obstacle_m", obstacle_m,
            "Height in metres above the ground without rocks and cavities from which on a cell is an obstacle.",
            between(0.01, 5));
    v.field("cavity_m", cavity_m, "Depth in metres below the ground without cavities from which on a cell is a cavity.",
            between(0.01, 5));
  }
};

}  // namespace spartan::sim
