#pragma once
#include <string>

#include "tools/report/subject.hpp"

namespace probebox::report {

// The parts of one subject's article, as HTML; empty where there is nothing to say.
std::string heading(const Subject& subject);
std::string budgetTable(const metrology::Result& result);
// Residuals against the noise: rms, chi-square with its expected range, and the readings furthest off in their sd.
std::string residualsTable(const metrology::Result& result);
std::string warningsList(const metrology::Result& result);
std::string droppedList(const metrology::Result& result);
std::string unobservableList(const Subject& subject);
// Method, equations, patent, and how well the readings were placed.
std::string factsTable(const metrology::Result& result);
// What was found on the way.
std::string alsoTable(const Subject& subject);
std::string conditionsTable(const Subject& subject);

}  // namespace probebox::report
