#pragma once
#include <string>

#include "tools/report/subject.hpp"

namespace probebox::report {

// Every promised value: scalars and short vectors in one table, then one table for each matrix (an axis: its angles by
// six errors) and each long vector. Values have the place that U, of two digits, ends at; the full digits stand in the
// titles of the cells. Components that are zero by definition are named below instead.
std::string valueTables(const Subject& subject);

}  // namespace probebox::report
