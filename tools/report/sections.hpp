#pragma once
#include <string>

#include "tools/report/subject.hpp"

namespace probebox::report {

// The parts of one subject's article, as HTML; empty where there is nothing to say.
std::string heading(const Subject& subject);
// The first value with sd and U, or the refusal with its remedy.
std::string verdict(const Subject& subject);
// Every promised value. The full digits stand in the titles of the cells.
std::string valuesTable(const metrology::Result& result);
std::string budgetTable(const metrology::Result& result);
std::string warningsList(const metrology::Result& result);
std::string droppedList(const metrology::Result& result);
std::string unobservableList(const metrology::Result& result);
// Method, equations, patent, and the quality of the fit.
std::string factsTable(const metrology::Result& result);
// What was found on the way.
std::string alsoTable(const metrology::Result& result);
std::string conditionsTable(const Subject& subject);

}  // namespace probebox::report
