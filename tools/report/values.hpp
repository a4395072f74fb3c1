#pragma once
#include <string>

#include "tools/report/subject.hpp"

namespace probebox::report {

// Tables of every promised value: one for scalars and short vectors, then one for each matrix (such as the angles of an
// axis by six errors) and each long vector. Values are rounded to the last place of U, which has two digits; tooltips
// hold the full digits. Components that are zero by definition are listed below instead.
std::string valueTables(const Subject& subject);

// A table of one matrix alone.
std::string matrixTable(const Subject& subject, const metrology::Estimate& estimate);

}  // namespace probebox::report
