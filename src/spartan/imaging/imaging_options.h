// Options of the imaging stage, one struct a sub-step.
#pragma once

#include <string>

#include "spartan/core/options.h"

namespace spartan {

struct LocalContrastOptions {
  bool enabled = false;
  int tiles = 8;
  double clip = 2;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled,
            "equalise the gray levels tile by tile (CLAHE), each eye for itself: the same surface may get different "
            "levels in the two eyes");
    v.field("tiles", tiles, "across and down the image", between(1, 64));
    v.field("clip", clip, "no level may occur more often in a tile than so many times the mean", between(1, 256));
  }
};

struct ViewOptions {
  std::string policy = "keep_resolution";
  int width_px = 0, height_px = 0;
  double focal_px = 0;
  double depth_m = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "policy", policy,
        "keep_resolution: the cameras' own, what looks past a sensor is masked; all_valid: as wide as both eyes see "
        "every pixel; whole_view: everything that either eye sees",
        {"keep_resolution", "all_valid", "whole_view"});
    v.field("width_px", width_px, "of the rectified images; 0: as the left camera's", between(0, 32767));
    v.field("height_px", height_px, "of the rectified images; 0: as the left camera's", between(0, 32767));
    v.field("focal_px", focal_px, "of the rectified images; 0: as the policy has it", between(0, 1e6));
    v.field("depth_m", depth_m,
            "of the surface for which the view is right where a camera's rays do not meet in one point; 0: far away",
            between(0, 1e6));
  }
};

struct ImagingOptions {
  std::string debayer = "edge_aware";
  bool vignetting = true;
  bool contrast = true;
  bool balance = true;
  double contrast_low_percent = 0.1;
  double contrast_high_percent = 99.9;
  LocalContrastOptions local_contrast;
  bool rectify = true;
  ViewOptions view;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("debayer", debayer, "how colours are made of Bayer mosaics", {"bilinear", "edge_aware"});
    v.field("vignetting", vignetting, "undo the fall-off of light that the rig states");
    v.field("contrast", contrast, "stretch the gray levels, the same way for both eyes; false: no balance either");
    v.field("balance", balance,
            "before that, scale the right eye's levels to the left one's where the histograms differ by more than 5 %");
    v.field("contrast_low_percent", contrast_low_percent, "share of pixels that may become black", between(0, 50));
    v.field("contrast_high_percent", contrast_high_percent, "share of pixels below white", between(50, 100));
    v.group("local_contrast", local_contrast);
    v.field("rectify", rectify, "false: the images are rectified already, whatever the rig says");
    v.group("view", view);
  }
};

}  // namespace spartan
