#pragma once
#include <span>
#include <string>

#include "tools/report/subject.hpp"

namespace probebox::report {

// The parts of one subject's article, as HTML; empty without content.
std::string heading(const Subject& subject);
// Promised values that standards have terms for, with these.
std::string standardsTable(const Subject& subject);
std::string budgetTable(const metrology::Result& result);
// Residuals against the noise: rms, chi-square with its expected range, and the readings furthest off in their sd.
std::string residualsTable(const metrology::Result& result);
std::string warningsList(const metrology::Result& result);
std::string droppedList(const metrology::Result& result);
std::string unobservableList(const Subject& subject);
// Method, equations, source, and design figures of the readings.
std::string factsTable(const metrology::Result& result);
// Table of further estimates (`also`).
std::string alsoTable(const Subject& subject);
std::string conditionsTable(const Subject& subject);
// Rows of a table of two columns, by the names that people use.
std::string conditionRows(std::span<const metrology::Condition> conditions);

}  // namespace probebox::report
