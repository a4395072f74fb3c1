#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Methods "web-fit" and "pocket-fit": middle and width between two opposed faces (docs/metrology.md B.0b, (B3b)). Table
// points{face,x_mm,y_mm,z_mm}: stylus-ball centres, face 1 or 2. Config: width_direction, a unit vector across the
// faces (needed); sigma_mm; stylus_ball_radius_mm. Gives middle_mm, along width_direction, and effective_width_mm; with
// stylus_ball_radius_mm also width_mm, the feature's own. Refuses: missing-key, bad-config, bad-face, missing-face (one
// without touches), duplicated-reading, residual-too-large (4 sigma), width-not-positive.
Outcome<Result, Refusal> solveWebFit(const Dataset& dataset);
Outcome<Result, Refusal> solvePocketFit(const Dataset& dataset);

// Method "corner-fit": corner of a block from touches of two of its faces (lines in a plane) or of three (planes)
// (docs/metrology.md B.0b, (B3c)). Table points{face,x_mm,y_mm,z_mm}: stylus-ball centres; table faces{face,nx,ny,nz}:
// outward normals, roughly, within 30 degrees. Each face is fitted by itself and moved in by the stylus' radius along
// its own normal; they need not be square. Config: stylus_ball_radius_mm (needed); sigma_mm; feature_axis, along X, Y
// or Z (default +Z), across which the lines of two faces lie. Gives corner_xy_mm (yz, xz) of two faces, corner_mm of
// three; also square_error_rad, by which the angle between faces 1 and 2 exceeds a right one. Refuses: missing-key,
// bad-config, bad-axis, bad-face, missing-face, duplicated-reading, too-few-readings (2 points a line, 3 a plane),
// collinear, bad-direction, faces-parallel (within 6 degrees), residual-too-large (4 sigma), and what leastSquares
// refuses.
Outcome<Result, Refusal> solveCornerFit(const Dataset& dataset);

extern const Method kWebFit;
extern const Method kPocketFit;
extern const Method kCornerFit;

}  // namespace probebox::metrology
