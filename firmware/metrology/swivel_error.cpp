#include "firmware/metrology/swivel_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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
// How much the sum of squares may fall from rigid to free, 4 parameters more, before rigid is given up: 4 + 4 sqrt(8).
constexpr double kContradiction = 16.0;

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

  Eigen::MatrixXd terms(double swivel_deg, double length) const {
    const double angle = plane.sense * swivel_deg * kDegree;
    const double sine = std::sin(angle);
    const double rest = 1.0 - std::cos(angle);
    Eigen::MatrixXd terms = Eigen::MatrixXd::Zero(3, parameters());
    if (kind != Kind::rigid) {
      const Eigen::Index each = kind == Kind::sine ? 2 : 4;
      for (Eigen::Index k = 0; k < 3; ++k) {
        terms.row(k).segment(each * k, 2) << sine, sine * length;
        if (each == 4) terms.row(k).segment(each * k + 2, 2) << rest, rest * length;
      }
      return terms;
    }
    const Eigen::Matrix2d moved = Eigen::Matrix2d::Identity() - turn(angle);  // -(R2(B) - I)
    terms.row(plane.first).head(4) << moved.row(0), moved.row(0) * length;
    terms.row(plane.second).head(4) << moved.row(1), moved.row(1) * length;
    terms.row(plane.axis).segment(4, 2) << sine, sine * length;
    if (one_minus_cosine) terms.row(plane.axis).segment(6, 2) << rest, rest * length;
    return terms;
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

// Parameters: those of the model, then the ball as reported at B = 0 for each length.
Outcome<Fit, Refusal> fitSwivel(const std::vector<SwivelReading>& readings, const SwivelModel& model, double sigma) {
  std::vector<double> lengths;
  for (const auto& reading : readings) {
    if (std::ranges::find(lengths, reading.length) == lengths.end()) lengths.push_back(reading.length);
  }
  const Eigen::Index own = model.parameters();
  const auto rows = static_cast<Eigen::Index>(3 * readings.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, own + static_cast<Eigen::Index>(3 * lengths.size()));
  Eigen::VectorXd values{rows};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(3 * k);
    const auto base = 3 * (std::ranges::find(lengths, readings[k].length) - lengths.begin());
    design.block(row, 0, 3, own) = model.terms(readings[k].swivel_deg, readings[k].length);
    design.block<3, 3>(row, own + base).setIdentity();
    values.segment<3>(row) = readings[k].at;
  }
  return linearLeastSquares(design / sigma, values / sigma);
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

struct Chosen {
  SwivelModel model;
  Fit fit;
  std::string warning;  // empty: nothing to say
};

// Rigid unless two or more angles contradict it.
Outcome<Chosen, Refusal> choose(const std::vector<SwivelReading>& readings, SwivelModel model, const Sigma& sigma,
                                std::optional<Kind> stated) {
  model.kind = stated.value_or(Kind::rigid);
  auto fit = fitSwivel(readings, model, sigma.value);
  if (!fit) return fit.error();
  Chosen chosen{model, std::move(fit).value(), {}};
  if (model.kind == Kind::sine) {
    chosen.warning =
        "the sine rule leaves out 1 - cos B: between the measured angles it may be wrong by tens of um; use rigid";
  } else if (model.kind == Kind::rigid && !model.one_minus_cosine) {
    chosen.warning =
        "one swivel angle cannot tell sin B from 1 - cos B along the axis, which is taken as sin B: measure "
        "at 45 degrees too";
  }
  if (stated || !model.one_minus_cosine) return chosen;
  model.kind = Kind::free;
  auto free = fitSwivel(readings, model, sigma.value);
  if (!free) return chosen;
  const double scale = sigma.stated     ? 1.0
                       : free->dof >= 4 ? free->sumOfSquares() / static_cast<double>(free->dof)
                                        : std::numeric_limits<double>::infinity();
  if ((chosen.fit.sumOfSquares() - free->sumOfSquares()) / scale <= kContradiction) return chosen;
  return Chosen{model, std::move(free).value(),
                "the readings contradict a rigid head: sin B and 1 - cos B are fitted for each coordinate"};
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
  const auto chosen = choose(readings, model, sigma.value(), stated.value());
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
  answer.promiseMatrix("error_at_queries_mm", 3, jacobian * parameters, jacobian);
  answer.result().also.push_back(Estimate::scalar("model", static_cast<double>(chosen->model.kind), std::nullopt));
  if (chosen->model.kind == Kind::rigid) {
    answer.alsoVector("gauge_line_mm", parameters.head(2), pick(0, 2, parameters.size()));
    answer.alsoVector("tool_direction_rad", parameters.segment(2, 2), pick(2, 2, parameters.size()));
  }
  if (!chosen->warning.empty()) answer.warn(chosen->warning);
  for (auto& warning : equalRows(**table)) answer.warn(std::move(warning));
  for (auto& warning : unusedKeys(dataset, kKeys)) answer.warn(std::move(warning));
  answer.result().convention = "reported ball centre at B minus that at B = 0; add it to the commanded tool point";
  return std::move(answer).take(false);
}

}  // namespace probebox::metrology
