#include "firmware/metrology/tilt/swivel_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/relative_sigma.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/further_reading.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/tilt/swivel_fit.hpp"
#include "firmware/metrology/tilt/swivel_lengths.hpp"
#include "firmware/metrology/tilt/swivel_stops.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kToolDirection{.key = "tool_direction_rad", .kind = QuantityKind::lean};

constexpr MethodColumn kQueryColumns[]{column::kB, column::kToolLength};
// How rarely chance alone may make rigid look wrong: four deviations of chi-square with 4 degrees of freedom.
constexpr double kChance = 0.003;
// What rounding leaves of a variance that is nothing, as a share.
constexpr double kRounding = 1e-9;

using Kind = SwivelKind;

Outcome<std::optional<Kind>, Refusal> statedKind(const Dataset& dataset) {
  const auto entry = dataset.config.find("model");
  if (entry == dataset.config.end()) return std::optional<Kind>{};
  const auto* name = std::get_if<std::string>(&entry->second);
  if (name && *name == "sine") return std::optional<Kind>{Kind::sine};
  if (name && *name == "rigid") return std::optional<Kind>{Kind::rigid};
  if (name && *name == "free") return std::optional<Kind>{Kind::free};
  return Refusal{"bad-config", "config key 'model' must be \"sine\", \"rigid\" or \"free\""};
}

constexpr std::array<std::string_view, 3> kNames{"sine", "rigid", "free"};

// Every model that the readings determine, fitted.
struct Candidates {
  std::array<std::optional<Fit>, 3> fits;
  std::optional<Refusal> rigid_refused;

  const std::optional<Fit>& of(Kind kind) const { return fits[static_cast<std::size_t>(kind)]; }
  // Root mean square of the residuals, mm; nothing without redundancy.
  std::optional<double> rms(Kind kind, double sigma) const {
    const auto& fit = of(kind);
    if (!fit || fit->dof == 0) return std::nullopt;
    return sigma * std::sqrt(fit->sumOfSquares() / static_cast<double>(fit->dof));
  }
};

// How probable it is that four parameters take off so much of a sum of squares by chance: chi-square with 4 degrees of
// freedom; F with 4 and `dof` where the variance comes from what is left.
double chanceOf(double taken_off, double left, std::size_t dof, bool stated) {
  if (stated) return std::exp(-0.5 * taken_off) * (1.0 + 0.5 * taken_off);
  const double half = 0.5 * static_cast<double>(dof);
  const double share = left / (left + taken_off);
  return std::pow(share, half) * (1.0 + half * (1.0 - share));
}

bool rigidContradicted(const Candidates& candidates, const Sigma& sigma) {
  const auto& rigid = candidates.of(Kind::rigid);
  const auto& free = candidates.of(Kind::free);
  if (!rigid || !free || (!sigma.stated && free->dof == 0)) return false;
  const double left = free->sumOfSquares();
  return chanceOf(rigid->sumOfSquares() - left, left, free->dof, sigma.stated) < kChance;
}

struct Chosen {
  SwivelModel model;
  Fit fit;
  Kind recommended{Kind::rigid};
  std::vector<std::string> warnings;
};

void explain(Chosen& chosen, const Candidates& candidates, double sigma, bool stated) {
  const Kind kind = chosen.model.kind;
  if (kind == Kind::sine) {
    chosen.warnings.emplace_back(
        "the sine model omits 1 - cos B: between the measured angles its error can reach tens of um; use rigid");
  } else if (kind == Kind::rigid && !chosen.model.one_minus_cosine) {
    chosen.warnings.emplace_back(
        "one swivel angle cannot separate sin B from 1 - cos B along the axis; sin B is assumed, and its sd covers the "
        "other case: measure at 45 degrees too");
  }
  if (chosen.recommended != Kind::free) return;
  if (!stated) {
    chosen.warnings.push_back(
        std::string{kReadingsContradict} +
        ": the readings contradict a rigid head: sin B and 1 - cos B are fitted for each coordinate");
  } else if (kind != Kind::free) {
    const auto name = std::string{kNames[static_cast<std::size_t>(kind)]};
    chosen.warnings.push_back(std::string{kReadingsContradict} + ": the readings contradict model " + name + " (rms " +
                              text(candidates.rms(kind, sigma).value_or(0.0)) + " mm): they support free (rms " +
                              text(candidates.rms(Kind::free, sigma).value_or(0.0)) + " mm)");
  }
}

// Rigid, unless two or more angles contradict it.
Outcome<Chosen, Refusal> choose(const Candidates& candidates, SwivelModel model, const Sigma& sigma,
                                std::optional<Kind> stated) {
  const Kind recommended = model.one_minus_cosine && rigidContradicted(candidates, sigma) ? Kind::free : Kind::rigid;
  model.kind = stated.value_or(recommended);
  const auto& fit = candidates.of(model.kind);
  if (!fit) {
    if (candidates.rigid_refused) return *candidates.rigid_refused;
    return Refusal{"ill-conditioned", "the readings do not determine model free: it needs two angles other than zero"};
  }
  Chosen chosen{model, *fit, recommended, {}};
  explain(chosen, candidates, sigma.value, stated.has_value());
  return chosen;
}

Candidates fitAll(const SwivelReadings& readings, SwivelModel model, double sigma) {
  Candidates candidates;
  for (const Kind kind : {Kind::sine, Kind::rigid, Kind::free}) {
    // Readings with a shank combine with the lengths in the model of a rigid head only.
    if (kind != Kind::rigid && readings.byShank()) continue;
    if (kind == Kind::free && !model.one_minus_cosine) continue;
    model.kind = kind;
    auto fit = fitSwivel(readings, model, sigma);
    if (fit) candidates.fits[static_cast<std::size_t>(kind)] = std::move(fit).value();
    if (!fit && kind == Kind::rigid) candidates.rigid_refused = fit.error();
  }
  return candidates;
}

// Residuals of the model at each stop of B, averaged over the lengths, minus those at zero: rows B_deg, x, y, z. An
// index error of B shows here.
Estimate leftByAngle(const SwivelReadings& readings, const Chosen& chosen, double sigma,
                     std::optional<double> reading_sd) {
  const auto stops = swivelStops(readings);
  const auto level = std::ranges::find_if(stops, &SwivelStop::level);
  // Residuals are the readings less what the fit has drawn them to; the two are uncorrelated.
  const Eigen::MatrixXd design = swivelDesign(readings, chosen.model);
  const Eigen::MatrixXd seen = chosen.fit.cofactor / (sigma * sigma);
  const Eigen::VectorXd left = swivelValues(readings, chosen.model.plane.axis) - design * chosen.fit.parameters;
  const auto meanOver = [&](const std::vector<std::size_t>& rows, Eigen::Index axis) {
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(left.size());
    for (const auto row : rows) {
      weights[3 * static_cast<Eigen::Index>(row) + axis] = 1.0 / static_cast<double>(rows.size());
    }
    return weights;
  };
  std::vector<double> values;
  std::vector<double> sds;
  for (const auto& [angle, rows] : stops) {
    values.push_back(angle);
    sds.push_back(0.0);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Eigen::VectorXd weights = meanOver(rows, axis);
      if (level != stops.end()) weights -= meanOver(level->tips, axis);
      const Eigen::VectorXd drawn = design.transpose() * weights;
      const double spread = axis == chosen.model.plane.axis ? readings.along_spread : 1.0;
      values.push_back(spread * weights.dot(left));
      const double whole =
          weights.squaredNorm() + squareOfStops(readings, chosen.model.plane, weights) / (sigma * sigma);
      const double square = whole - drawn.dot(seen * drawn);
      const bool fitted = square <= kRounding * whole;  // as many terms as readings: nothing is left
      if (fitted) values.back() = 0.0;
      sds.push_back(fitted ? 0.0 : spread * reading_sd.value_or(0.0) * std::sqrt(square));
    }
  }
  if (!reading_sd) sds.clear();
  return Estimate::matrix(quantity::kLeftByAngle, 4, std::move(values), std::move(sds));
}

// Adds the chosen model, how well each candidate fits, and the values that live corrections need.
void addModel(Answer& answer, const Chosen& chosen, const Candidates& candidates, const SwivelReadings& readings,
              const Sigma& sigma) {
  const auto& parameters = chosen.fit.parameters;
  auto& also = answer.result().also;
  also.push_back(Estimate::scalar("model", static_cast<double>(chosen.model.kind), std::nullopt));
  also.push_back(Estimate::scalar("recommended_model", static_cast<double>(chosen.recommended), std::nullopt));
  for (const Kind kind : {Kind::sine, Kind::rigid, Kind::free}) {
    const auto rms = candidates.rms(kind, sigma.value);
    const auto name = "rms_" + std::string{kNames[static_cast<std::size_t>(kind)]} + "_mm";
    if (rms) also.push_back(Estimate::scalar(name, *rms, std::nullopt));
  }
  if (chosen.model.kind == Kind::rigid) {
    answer.alsoVector("gauge_line_mm", parameters.head(2), pick(0, 2, parameters.size()));
    Eigen::MatrixXd direction = Eigen::MatrixXd::Zero(2, parameters.size());
    direction.leftCols(chosen.model.parameters()) = chosen.model.direction();
    answer.alsoVector(kToolDirection, direction * parameters, direction);
  }
  if (readings.byShank()) {
    const Eigen::Index last = parameters.size() - 1;
    answer.alsoScalar("shank_effective_radius_mm", parameters[last], pick(last, 1, parameters.size()).row(0));
  }
  const Eigen::MatrixXd terms = chosen.model.map() * pick(0, chosen.model.parameters(), parameters.size());
  answer.alsoMatrix(quantity::kSwivelTerms, 4, terms * parameters, terms);
  also.push_back(leftByAngle(readings, chosen, sigma.value, sdOfFurtherReading(answer, chosen.fit, sigma)));
}

// A tool that hangs along Z with the head level: where a shank touched, what of t is along it is nothing.
SwivelModel modelFor(const SwivelReadings& readings, const SwivelPlane& plane) {
  SwivelModel model{.kind = Kind::rigid, .plane = plane, .one_minus_cosine = swivelAngles(readings) >= 2};
  if (readings.byShank()) model.without = plane.first == 2 ? 0 : 1;
  return model;
}

// Adds the residuals of tips and shank, mm.
void tellResiduals(Answer& answer, const SwivelReadings& readings, Eigen::Index axis) {
  std::vector<std::string> names;
  std::vector<double> at;
  for (std::size_t k = 0; k < readings.tips.size(); ++k) {
    for (const auto part : column::kPosition) {
      names.push_back("readings " + std::to_string(k + 1) + ", " + std::string{part});
      at.push_back(readings.tips[k].swivel_deg);
    }
  }
  for (std::size_t k = 0; k < readings.shank.size(); ++k) {
    names.push_back("shank " + std::to_string(k + 1));
    at.push_back(readings.shank[k].reading.swivel_deg);
  }
  answer.readings(names, at, column::kB);
  auto& values = answer.result().residuals.values;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (k >= 3 * readings.tips.size())
      values[k] *= readings.shank_spread;
    else if (static_cast<Eigen::Index>(k % 3) == axis)
      values[k] *= readings.along_spread;
  }
}

}  // namespace

Outcome<Result, Refusal> solveSwivelError(const Dataset& dataset) {
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto plane, swivelPlane(dataset, "swivel_axis"));
  TRY(const auto stated, statedKind(dataset));
  TRY(auto readings, readSwivelReadings(dataset, plane));
  if (readings.byShank() && stated.value_or(Kind::rigid) != Kind::rigid) {
    return Refusal{"bad-config",
                   "a shank does not measure along the tool, so it needs model \"rigid\": omit 'model', or read with "
                   "tips of two lengths"};
  }
  TRY(const auto of_shank, relativeSigma(dataset, "sigma_shank_mm", sigma));
  TRY(const auto along, relativeSigma(dataset, "sigma_along_mm", sigma));
  readings.shank_spread = of_shank.ratio;
  readings.along_spread = along.ratio;
  TRY(const auto about_stops, takeStops(readings, dataset, sigma));
  TRY(const auto queries, checkedTable(dataset, "queries", kQueryColumns));
  const SwivelModel model = modelFor(readings, plane);
  const Candidates candidates = fitAll(readings, model, sigma.value);
  TRY(auto chosen, choose(candidates, model, sigma, stated));
  if (chosen.model.kind == Kind::rigid && !model.one_minus_cosine) {
    TRY(auto fit, fitEitherShape(readings, chosen.model, chosen.fit, sigma));
    chosen.fit = std::move(fit);
    chosen.model.one_minus_cosine = true;
  }

  const auto& parameters = chosen.fit.parameters;
  const auto rows = static_cast<Eigen::Index>(queries->rows());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * rows, parameters.size());
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    jacobian.block(3 * k, 0, 3, chosen.model.parameters()) =
        chosen.model.terms((*queries->column(column::kB))[row], (*queries->column(column::kToolLength))[row]);
  }
  Answer answer{dataset, chosen.fit, sigma};
  tellResiduals(answer, readings, plane.axis);
  answer.promiseMatrix(quantity::kErrorAtQueries, 3, jacobian * parameters, jacobian);
  for (const auto column : kQueryColumns) {
    answer.result().also.push_back(Estimate::vector("query_" + std::string{column}, *queries->column(column), {}));
  }
  addModel(answer, chosen, candidates, readings, sigma);
  for (const auto& warning : chosen.warnings) answer.warn(warning);
  for (const auto& warning : about_stops) answer.warn(warning);
  for (const auto* table : {dataset.table("readings"), dataset.table("shank")}) {
    if (!table) continue;
    for (auto& warning : equalRows(*table)) answer.warn(std::move(warning));
  }
  for (const auto* spread : {&of_shank, &along}) {
    for (const auto& warning : spread->warnings) answer.warn(warning);
  }
  answer.result().convention = "reported ball centre at B minus that at B = 0; add it to the commanded tool point";
  return std::move(answer).take(true);
}

namespace {

constexpr MethodTable kTables[]{
    {"readings", kSwivelColumns, "reported centre of the ball at B, read with a tool of length L", true},
    {"shank", kShankColumns, "where a shank touched: the mean of two touches from the side (ux,uy,uz) (B16)", true},
    {"queries", kQueryColumns, "where the error is wanted"}};
constexpr MethodKey kMethodKeys[]{
    key::kSwivelAxis,
    key::kSigma,
    {"sigma_shank_mm", "sigma_mm", "standard deviation of one row of shank (k = 1)"},
    {"sigma_along_mm", "sigma_mm", "standard deviation of a tip's coordinate along the axis (k = 1)"},
    key::kSigmaAngle,
    {"pivot_mm", "",
     "from the gauge line to the swivel axis with the head level and tools towards -Z, x y z; needed with "
     "sigma_angle_rad"},
    {"model", "", "rigid, free or sine; without it rigid, or free where readings contradict rigid"},
    key::kLengthResults[0],
    key::kLengthResults[1],
    key::kLengthResults[2],
    key::kLengthResults[3],
    key::kPreTravelResults[0],
    key::kPreTravelResults[1],
    key::kPreTravelResults[2],
    key::kPreTravelResults[3],
    key::kTauForTheRecord};
constexpr Quantity kResults[]{quantity::kErrorAtQueries};
constexpr Quantity kFurther[]{quantity::kQueryB, quantity::kQueryLength, quantity::kSwivelTerms, quantity::kLeftByAngle,
                              kToolDirection};
constexpr std::string_view kUnobservable[]{
    "any error at B = 0: all results are relative to B = 0",
    "errors between the measured angles that the model does not contain",
    "an error of a tool's length L_mm: the readings move as by the head's own error; sd_length_N_mm states it"};

std::optional<Subject> swivelSubject(const Dataset& dataset) {
  const auto plane = swivelPlane(dataset, "swivel_axis");
  if (!plane) return std::nullopt;
  return aboutAxis(SubjectKind::swivel, static_cast<std::size_t>(plane->axis));
}

}  // namespace

const Method kSwivelError{.name = "swivel-error",
                          .title = "Error of the swivelling head",
                          .equations = "(B17)-(B21)",
                          .source = source::kMachine,
                          .solver = solveSwivelError,
                          .tables = kTables,
                          .keys = kMethodKeys,
                          .known = kLengthsOfSwivel,
                          .moved_by = movedByLength,
                          .results = kResults,
                          .further = kFurther,
                          .unobservable = kUnobservable,
                          .subject = {.of = swivelSubject}};

}  // namespace probebox::metrology
