#pragma once
#include <vector>

#include "tools/report/subject.hpp"
#include "tools/report/svg.hpp"

namespace probebox::report {

// The pictures that tell most about this answer, the most telling first; of a refusal those of the raw data. A picture
// whose data are not at hand is left out.
std::vector<Plot> pictures(const Subject& subject);

// One kind of picture each, in a file of its own. Empty where the data are not there.

// Read minus fitted, reading by reading.
std::vector<Plot> residualPictures(const metrology::Result& result);
// Measured size against speed with the fitted line and its intercept (A10), and what is left of it.
std::vector<Plot> sizePictures(const Subject& subject);
// Machine and probe of one touch or scan, as they were stamped, and with the delay taken out of the machine's stamps.
std::vector<Plot> streamPictures(const metrology::Dataset& dataset, const metrology::Result& result);
// The same of a case that has no answer: as stamped.
std::vector<Plot> rawStreamPictures(const metrology::Dataset& dataset);
// Readings of one feature around the centre, what they are off the circle magnified.
std::vector<Plot> turnPictures(const metrology::Dataset& dataset, const metrology::Result& result);
// Six errors against the angle, and the vectors of the table's centre around its axis.
std::vector<Plot> rotaryPictures(const Subject& subject);
// The sensor in time, the table of sectors, and the compensation.
std::vector<Plot> screwPictures(const Subject& subject);
// Error of the head at the queried angles.
std::vector<Plot> swivelPictures(const metrology::Dataset& dataset, const metrology::Result& result);
// Points of a sphere or of readings in the plane of the machine, with the circle where there is one.
std::vector<Plot> planePictures(const metrology::Dataset& dataset, const metrology::Result* result);
// Every column of the tables against the first one: what there is to see of any case.
std::vector<Plot> tablePictures(const metrology::Dataset& dataset);

}  // namespace probebox::report
