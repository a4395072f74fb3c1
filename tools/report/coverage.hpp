#pragma once
#include <cstddef>
#include <string>

#include "firmware/metrology/dataset/estimate.hpp"
#include "firmware/metrology/dataset/result.hpp"

// Coverage of an expanded uncertainty, JCGM 100:2008 annex G.
namespace probebox::report {

// Degrees of freedom of the sd of the readings: nu of the fit where that comes from its residuals, those of the noise
// where that was learned, infinite where it was stated.
double readingsDof(const metrology::Result& result);

// "80", or the sign of infinity.
std::string dofText(double dof);

// Probability that a value of Student's t with `dof` degrees of freedom, which may be infinite, lies within +- k.
double coverageProbability(double k, double dof);

// Probability that the true value lies within +- k uncertainties of value `at`. An sd by residuals is that of Student's
// t (metrology/fit/chi_square.hpp), wider by sqrt(n/(n - 2)) than the s that t counts in.
double coverageOf(const metrology::Result& result, const metrology::Estimate& estimate, std::size_t at, double k);

// Effective degrees of freedom of the combined uncertainty of value `at`, Welch-Satterthwaite (G.2b): type A with those
// of the readings, type B and the stops of axes that stood still with infinitely many. Infinite where the noise of the
// readings was stated.
double effectiveDof(const metrology::Result& result, const metrology::Estimate& estimate, std::size_t at);

}  // namespace probebox::report
