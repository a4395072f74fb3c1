#include "firmware/metrology/swivel_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/answer.hpp"
#include "firmware/metrology/ball_readings.hpp"
#include "firmware/metrology/swivel_plane.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 5> kColumns{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 2> kQueryColumns{"B_deg", "L_mm"};
constexpr std::array<std::string_view, 3> kKeys{"swivel_axis", "sigma_mm", "model"};
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLeastLengths = 10.0;  // mm
constexpr double kLeastSine = 0.2;
// How rarely chance alone may make rigid look wrong: four deviations of chi-square with 4 degrees of freedom.
constexpr double kChance = 0.003;

enum class Kind { sine, rigid, free };

// A model that is linear in its parameters: E = terms(B, L) * p.
struct SwivelModel {
  Kind kind{Kind::rigid};
  SwivelPlane plane;
  bool one_minus_cosine{true};  // known along the axis; one angle alone cannot tell it from the sine

  Eigen::Index parameters() const {
    if (kind == Kind::sine) return 6;
    return kind == Kind::free ? 12 : one_minus_cosine ? 8 : 6;
  }

  // The common form of all three models, as a linear map of the parameters: for x, y and z the factors of sin B,
  // L sin B, 1 - cos B and L (1 - cos B).
  Eigen::MatrixXd map() const {
    Eigen::MatrixXd map = Eigen::MatrixXd::Zero(12, parameters());
    if (kind != Kind::rigid) {
      const Eigen::Index each = kind == Kind::sine ? 2 : 4;
      for (Eigen::Index k = 0; k < 3; ++k) map.block(4 * k, each * k, each, each).setIdentity();
    } else {
      // -(R2(B) - I) (q + L t): q in 0 and 1, t in 2 and 3.
      for (const Eigen::Index l : {0, 1}) {
        map(4 * plane.first + l, 2 * l + 1) = 1.0;
        map(4 * plane.first + 2 + l, 2 * l) = 1.0;
        map(4 * plane.second + l, 2 * l) = -1.0;
        map(4 * plane.second + 2 + l, 2 * l + 1) = 1.0;
      }
      const Eigen::Index along = one_minus_cosine ? 4 : 2;
      map.block(4 * plane.axis, 4, along, along).setIdentity();
    }
    for (Eigen::Index k = 0; k < 3; ++k) map.middleRows(4 * k, 2) *= plane.sense;  // sin of the turned sense
    return map;
  }

  Eigen::MatrixXd terms(double swivel_deg, double length) const {
    const double sine = std::sin(swivel_deg * kDegree);
    const double rest = 1.0 - std::cos(swivel_deg * kDegree);
    Eigen::MatrixXd factors = Eigen::MatrixXd::Zero(3, 12);
    for (Eigen::Index k = 0; k < 3; ++k) {
      factors.row(k).segment<4>(4 * k) << sine, sine * length, rest, rest * length;
    }
    return factors * map();
  }
};

struct SwivelReading {
  double swivel_deg{};
  double length{};
  Eigen::Vector3d at;
};

std::vector<SwivelReading> readingsOf(const Table& table) {
  std::vector<SwivelReading> readings;
  const auto value = [&](std::size_t column, std::size_t row) { return (*table.column(kColumns[column]))[row]; };
  for (std::size_t row = 0; row < table.rows(); ++row) {
    readings.push_back({value(0, row), value(1, row), {value(2, row), value(3, row), value(4, row)}});
  }
  return readings;
}

std::optional<Refusal> badReadings(const std::vector<SwivelReading>& readings) {
  const auto [shortest, longest] = std::ranges::minmax(readings, {}, &SwivelReading::length);
  if (longest.length - shortest.length < kLeastLengths) {
    return Refusal{"length-span-too-small", "the tool lengths span " + text(longest.length - shortest.length) +
                                                " mm, less than 10: read with two probes, two tips, or tip and shank"};
  }
  const auto sine = [](const SwivelReading& reading) { return std::abs(std::sin(reading.swivel_deg * kDegree)); };
  if (sine(std::ranges::max(readings, {}, sine)) < kLeastSine) {
    return Refusal{"swivel-angle-too-small", "no reading has |sin B| above 0.2: swivel to 90 degrees, and to 45"};
  }
  return std::nullopt;
}

// Angles other than zero, whole turns aside.
std::size_t swivelAngles(const std::vector<SwivelReading>& readings) {
  std::set<long long> angles;
  for (const auto& reading : readings) {
    const auto angle = std::llround(std::remainder(reading.swivel_deg, 360.0) * 1e6);
    if (angle != 0) angles.insert(angle);
  }
  return angles.size();
}

// Three rows a reading. Parameters: those of the model, then the ball as reported at B = 0 for each length.
Eigen::MatrixXd designOf(const std::vector<SwivelReading>& readings, const SwivelModel& model) {
  std::vector<double> lengths;
  for (const auto& reading : readings) {
    if (std::ranges::find(lengths, reading.length) == lengths.end()) lengths.push_back(reading.length);
  }
  const Eigen::Index own = model.parameters();
  const auto rows = static_cast<Eigen::Index>(3 * readings.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, own + static_cast<Eigen::Index>(3 * lengths.size()));
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(3 * k);
    const auto base = 3 * (std::ranges::find(lengths, readings[k].length) - lengths.begin());
    design.block(row, 0, 3, own) = model.terms(readings[k].swivel_deg, readings[k].length);
    design.block<3, 3>(row, own + base).setIdentity();
  }
  return design;
}

Outcome<Fit, Refusal> fitSwivel(const std::vector<SwivelReading>& readings, const SwivelModel& model, double sigma) {
  Eigen::VectorXd values{static_cast<Eigen::Index>(3 * readings.size())};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    values.segment<3>(static_cast<Eigen::Index>(3 * k)) = readings[k].at;
  }
  return linearLeastSquares(designOf(readings, model) / sigma, values / sigma);
}

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
  // Of a residual, mm; nothing without redundancy.
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
        "the sine rule leaves out 1 - cos B: between the measured angles it may be wrong by tens of um; use rigid");
  } else if (kind == Kind::rigid && !chosen.model.one_minus_cosine) {
    chosen.warnings.emplace_back(
        "one swivel angle cannot tell sin B from 1 - cos B along the axis, which is taken as sin B: measure "
        "at 45 degrees too");
  }
  if (chosen.recommended != Kind::free) return;
  if (!stated) {
    chosen.warnings.emplace_back(
        "the readings contradict a rigid head: sin B and 1 - cos B are fitted for each coordinate");
  } else if (kind != Kind::free) {
    const auto name = std::string{kNames[static_cast<std::size_t>(kind)]};
    chosen.warnings.push_back("the readings contradict model " + name + " (rms " +
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

Candidates fitAll(const std::vector<SwivelReading>& readings, SwivelModel model, double sigma) {
  Candidates candidates;
  for (const Kind kind : {Kind::sine, Kind::rigid, Kind::free}) {
    if (kind == Kind::free && !model.one_minus_cosine) continue;
    model.kind = kind;
    auto fit = fitSwivel(readings, model, sigma);
    if (fit) candidates.fits[static_cast<std::size_t>(kind)] = std::move(fit).value();
    if (!fit && kind == Kind::rigid) candidates.rigid_refused = fit.error();
  }
  return candidates;
}

// What the model leaves at each angle, the mean over the lengths, less what it leaves at zero: rows B_deg, x, y, z. An
// index error of B shows here.
Estimate leftByAngle(const std::vector<SwivelReading>& readings, const Chosen& chosen, double sigma,
                     std::optional<double> reading_sd) {
  std::map<double, std::vector<std::size_t>> at_angle;
  for (std::size_t k = 0; k < readings.size(); ++k) at_angle[readings[k].swivel_deg].push_back(k);
  // Residuals are the readings less what the fit has drawn them to; the two are uncorrelated.
  const Eigen::MatrixXd design = designOf(readings, chosen.model);
  const Eigen::MatrixXd seen = chosen.fit.cofactor / (sigma * sigma);
  const Eigen::VectorXd left = -sigma * chosen.fit.residuals;
  const auto meanOver = [&](const std::vector<std::size_t>& rows, Eigen::Index axis) {
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(left.size());
    for (const auto row : rows) {
      weights[3 * static_cast<Eigen::Index>(row) + axis] = 1.0 / static_cast<double>(rows.size());
    }
    return weights;
  };
  std::vector<double> values;
  std::vector<double> sds;
  for (const auto& [angle, rows] : at_angle) {
    values.push_back(angle);
    sds.push_back(0.0);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Eigen::VectorXd weights = meanOver(rows, axis);
      if (at_angle.contains(0.0)) weights -= meanOver(at_angle.at(0.0), axis);
      const Eigen::VectorXd drawn = design.transpose() * weights;
      values.push_back(weights.dot(left));
      sds.push_back(reading_sd.value_or(0.0) *
                    std::sqrt(std::max(weights.squaredNorm() - drawn.dot(seen * drawn), 0.0)));
    }
  }
  if (!reading_sd) sds.clear();
  return Estimate::matrix("left_by_angle_mm", 4, std::move(values), std::move(sds));
}

// What stands beside the answer: which model it is and how well each fits, and all that live corrections need.
void addModel(Answer& answer, const Chosen& chosen, const Candidates& candidates,
              const std::vector<SwivelReading>& readings, double sigma) {
  const auto& parameters = chosen.fit.parameters;
  auto& also = answer.result().also;
  also.push_back(Estimate::scalar("model", static_cast<double>(chosen.model.kind), std::nullopt));
  also.push_back(Estimate::scalar("recommended_model", static_cast<double>(chosen.recommended), std::nullopt));
  for (const Kind kind : {Kind::sine, Kind::rigid, Kind::free}) {
    const auto rms = candidates.rms(kind, sigma);
    const auto name = "rms_" + std::string{kNames[static_cast<std::size_t>(kind)]} + "_mm";
    if (rms) also.push_back(Estimate::scalar(name, *rms, std::nullopt));
  }
  if (chosen.model.kind == Kind::rigid) {
    answer.alsoVector("gauge_line_mm", parameters.head(2), pick(0, 2, parameters.size()));
    answer.alsoVector("tool_direction_rad", parameters.segment(2, 2), pick(2, 2, parameters.size()));
  }
  const Eigen::MatrixXd terms = chosen.model.map() * pick(0, chosen.model.parameters(), parameters.size());
  answer.alsoMatrix("swivel_terms_mm", 4, terms * parameters, terms);
  also.push_back(leftByAngle(readings, chosen, sigma, answer.readingSd()));
}

}  // namespace

Outcome<Result, Refusal> solveSwivelError(const Dataset& dataset) {
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  const auto plane = swivelPlane(dataset, "swivel_axis");
  if (!plane) return plane.error();
  const auto stated = statedKind(dataset);
  if (!stated) return stated.error();
  const auto table = checkedTable(dataset, "readings", kColumns);
  if (!table) return table.error();
  const auto queries = checkedTable(dataset, "queries", kQueryColumns);
  if (!queries) return queries.error();
  const auto readings = readingsOf(**table);
  if (auto refusal = badReadings(readings)) return *refusal;
  const SwivelModel model{.kind = Kind::rigid, .plane = plane.value(), .one_minus_cosine = swivelAngles(readings) >= 2};
  const Candidates candidates = fitAll(readings, model, sigma->value);
  const auto chosen = choose(candidates, model, sigma.value(), stated.value());
  if (!chosen) return chosen.error();

  const auto& parameters = chosen->fit.parameters;
  const auto rows = static_cast<Eigen::Index>((*queries)->rows());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * rows, parameters.size());
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    jacobian.block(3 * k, 0, 3, chosen->model.parameters()) =
        chosen->model.terms((*(*queries)->column("B_deg"))[row], (*(*queries)->column("L_mm"))[row]);
  }
  Answer answer{dataset, chosen->fit, sigma.value()};
  answer.readings(**table, std::span{kColumns}.last(3), "B_deg");
  answer.promiseMatrix("error_at_queries_mm", 3, jacobian * parameters, jacobian);
  addModel(answer, chosen.value(), candidates, readings, sigma->value);
  for (const auto& warning : chosen->warnings) answer.warn(warning);
  for (auto& warning : equalRows(**table)) answer.warn(std::move(warning));
  for (auto& warning : unusedKeys(dataset, kKeys)) answer.warn(std::move(warning));
  answer.result().convention = "reported ball centre at B minus that at B = 0; add it to the commanded tool point";
  return std::move(answer).take(true);
}

}  // namespace probebox::metrology
