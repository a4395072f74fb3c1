#pragma once
#include <vector>

#include "tools/report/subject.hpp"
#include "tools/report/svg.hpp"

namespace probebox::report {

// Returns the plots for this answer, the most informative first; for a refusal, those of the raw data. Plots without
// data are omitted.
std::vector<Plot> pictures(const Subject& subject);

// The kinds of plots, each in a file of its own. Empty without data.

// Residuals (read minus fitted) by reading.
std::vector<Plot> residualPictures(const metrology::Result& result);
// Measured size against speed with the fitted line and its intercept (A10), and the residuals.
std::vector<Plot> sizePictures(const Subject& subject);
// Machine and probe of one touch or scan, as stamped, and with the delay removed from the machine's stamps.
std::vector<Plot> streamPictures(const metrology::Dataset& dataset, const metrology::Result& result);
// The same for a case without a result: as stamped only.
std::vector<Plot> rawStreamPictures(const metrology::Dataset& dataset);
// Readings of one feature around its centre, with magnified deviations from the circle.
std::vector<Plot> turnPictures(const metrology::Dataset& dataset, const metrology::Result& result);
// Six errors against the angle, and the vectors of the table's centre around its axis.
std::vector<Plot> rotaryPictures(const Subject& subject);
// Sensor against time, table of sectors, and compensation of a ball screw.
std::vector<Plot> screwPictures(const Subject& subject);
// Form of probing by direction: a map seen along the stylus, and the directions across it.
std::vector<Plot> formPictures(const metrology::Result& result);
// Error of the head at the queried angles.
std::vector<Plot> swivelPictures(const metrology::Dataset& dataset, const metrology::Result& result);
// Points of a sphere, or readings, projected on the machine's plane, with the fitted circle if there is one.
std::vector<Plot> planePictures(const metrology::Dataset& dataset, const metrology::Result* result);
// Every column of the tables against the first one, for cases without plots of their own.
std::vector<Plot> tablePictures(const metrology::Dataset& dataset);

}  // namespace probebox::report
