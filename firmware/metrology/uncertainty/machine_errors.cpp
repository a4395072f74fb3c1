#include "firmware/metrology/uncertainty/machine_errors.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/read_times.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/machine_accuracy.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kUsualReading_s = 60;  // five touches of a ball, and the way to the next
constexpr double kUsualTouch_s = 12;
constexpr double kWarmUp_min = 30;      // time constant of a drift
constexpr double kReversal_mm = 0.005;  // above the noise of an encoder at rest
constexpr double kTakenUp_mm = 0.010;   // further way, on which an axis takes up its lost motion
constexpr double kMm_um = 1e-3, kMillionth = 1e-6;

// Number of the axis that a column is a coordinate of.
std::optional<std::size_t> axisOf(const MethodColumn& described) {
  if (!isCoordinate(described.role)) return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (described.name.ends_with(column::kPosition[axis].name)) return axis;
  }
  return std::nullopt;
}

// A table of readings: its coordinates, and the rows of all tables before it.
struct Places {
  const Table* table{};
  std::array<const Column*, 3> axes{}, normals{};
  std::size_t first{};
  bool contacts{};
};

const MethodTable* described(const Method& method, const Table& table) {
  const auto found = std::ranges::find(method.tables, table.name, &MethodTable::name);
  return found == method.tables.end() ? nullptr : &*found;
}

// Not a certificate, nor places that are chosen or set.
bool wasRead(const MethodTable& table) {
  return table.readings ||
         std::ranges::find(table.columns, ColumnRole::coordinate, &MethodColumn::role) != table.columns.end();
}

// streams: those of samples, instead of those of readings.
std::vector<Places> placesOf(const Dataset& dataset, const Method& method, bool streams = false) {
  std::vector<Places> all;
  std::size_t rows = 0;
  for (const auto& table : dataset.tables) {
    const auto* about = described(method, table);
    if (about == nullptr || !wasRead(*about) || (table.column(column::kTime) != nullptr) != streams) continue;
    Places places{&table, {}, {}, rows, about->contacts};
    for (const auto& column : table.columns) {
      if (const auto axis = axisOf(columnOf(method, table.name, column.name))) places.axes.at(*axis) = &column;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto normal = std::ranges::find(table.columns, column::kNormal[axis].name, &Column::name);
      if (normal != table.columns.end()) places.normals.at(axis) = &*normal;
    }
    if (std::ranges::all_of(places.axes, [](const Column* column) { return column == nullptr; })) continue;
    rows += table.rows();
    all.push_back(places);
  }
  return all;
}

double middleOf(const std::vector<Places>& all, std::size_t axis) {
  double sum = 0, count = 0;
  for (const auto& places : all) {
    if (places.axes.at(axis) == nullptr) continue;
    for (const double value : places.axes.at(axis)->values) sum += value, count += 1;
  }
  return count > 0 ? sum / count : 0;
}

// Tables of what each place is moved by along an axis. by: of a table of places and a row of it.
template <class By>
std::vector<Table> along(std::size_t axis, const std::vector<Places>& all, const By& by) {
  std::vector<Table> moved;
  for (const auto& places : all) {
    if (places.axes.at(axis) == nullptr) continue;
    Column column{places.axes.at(axis)->name, {}};
    for (std::size_t row = 0; row < places.table->rows(); ++row) column.values.push_back(by(places, row));
    moved.push_back({places.table->name, {std::move(column)}});
  }
  return moved;
}

// Distance of each place from the middle of all along another axis, or the same.
std::vector<Table> byLever(std::size_t axis, std::size_t lever, const std::vector<Places>& all) {
  const double middle = middleOf(all, lever);
  return along(axis, all, [&](const Places& places, std::size_t row) {
    const auto* values = places.axes.at(lever);
    return values == nullptr ? 0.0 : kMillionth * (values->values[row] - middle);
  });
}

// A screw is not as warm in one half as in the other: each half has a scale of its own.
std::vector<Table> byHalf(std::size_t axis, const std::vector<Places>& all) {
  auto halves = byLever(axis, axis, all);
  for (auto& table : halves)
    for (double& value : table.columns.front().values) value = std::abs(value) / std::numbers::sqrt2;
  return halves;
}

// Since the first reading: by the stamps of the readings, or by their order.
std::vector<Table> byTime(std::size_t axis, const std::vector<Places>& all, double reading_s) {
  double first_s = HUGE_VAL;
  std::map<const Table*, std::vector<double>> times;
  for (const auto& places : all) {
    const auto* stamps = places.table->column(column::kTime);
    auto& read_at = times[places.table] = stamps != nullptr ? *stamps : readTimes(*places.table, reading_s);
    const bool in_order = stamps == nullptr && !areStamped(*places.table);
    const double before_s = in_order ? static_cast<double>(places.first) * reading_s : 0;
    for (double& time : read_at) first_s = std::min(first_s, time += before_s);
  }
  return along(axis, all, [&](const Places& places, std::size_t row) {
    const double minutes = (times.at(places.table)[row] - first_s) / 60;
    return kMm_um * kWarmUp_min * (1 - std::exp(-minutes / kWarmUp_min));
  });
}

// Half of the lost motion, towards the side of each contact; of places without a side along Z alone.
std::vector<Table> bySide(std::size_t axis, const std::vector<Places>& all) {
  return along(axis, all, [&](const Places& places, std::size_t row) {
    if (const auto* normal = places.normals.at(axis)) return kMm_um / 2 * normal->values[row];
    if (!places.contacts) return axis == 2 ? kMm_um / 2 : 0.0;
    const auto [least, most] = std::ranges::minmax(places.axes.at(axis)->values);
    const double half_width = (most - least) / 2;
    const double beside = places.axes.at(axis)->values[row] - (least + most) / 2;
    return half_width > kReversal_mm ? kMm_um / 2 * beside / half_width : kMm_um / 2;
  });
}

// The middle of what single contacts, or samples, lie around.
Eigen::Vector3d middleOfTouched(const Places& places) {
  Eigen::MatrixX3d points{static_cast<Eigen::Index>(places.table->rows()), 3};
  Eigen::Vector3d middle{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    middle[at] = middleOf({places}, axis);
    points.col(at).setConstant(middle[at]);
    if (const auto* values = places.axes.at(axis))
      points.col(at) = Eigen::VectorXd::Map(values->values.data(), points.rows());
  }
  if (const auto ball = algebraicBall(points)) return ball->centre;
  if (const auto circle = algebraicBall(points.leftCols<2>())) middle.head<2>() = circle->centre;
  return middle;
}

// The side of each place: the normal of its touch where the case states that, else away from the middle.
std::vector<Eigen::Vector3d> sidesTouched(const Dataset& dataset, const Places& places) {
  std::map<double, Eigen::Vector3d> normals;
  const auto* touches = dataset.table("touches");
  const auto* ids = places.table->column(column::kTouch);
  if (ids != nullptr && touches != nullptr && touches->rectangular()) {
    std::array<const std::vector<double>*, 4> columns{
        touches->column(column::kTouch), touches->column(column::kNormalX), touches->column(column::kNormalY),
        touches->column(column::kNormalZ)};
    const bool are_there = std::ranges::none_of(columns, [](const auto* column) { return column == nullptr; });
    for (std::size_t row = 0; are_there && row < touches->rows(); ++row)
      normals[(*columns[0])[row]] = {(*columns[1])[row], (*columns[2])[row], (*columns[3])[row]};
  }
  const Eigen::Vector3d middle = normals.empty() ? middleOfTouched(places) : Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> sides;
  for (std::size_t row = 0; row < places.table->rows(); ++row) {
    Eigen::Vector3d side = Eigen::Vector3d::Zero();
    if (!normals.empty()) {
      const auto normal = normals.find((*ids)[row]);
      if (normal != normals.end()) side = normal->second;
    } else {
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (const auto* values = places.axes.at(axis))
          side[static_cast<Eigen::Index>(axis)] = values->values[row] - middle[static_cast<Eigen::Index>(axis)];
      side.stableNormalize();
    }
    sides.push_back(side);
  }
  return sides;
}

// What three lobes of a probe, of 3 um, leave on the sides of single contacts and of samples around Z; cosine or sine.
std::vector<Table> byLobes(const Dataset& dataset, const std::vector<Places>& all, bool sine) {
  std::vector<Table> moved;
  for (const auto& places : all) {
    const bool is_one_side = places.contacts || places.table->column(column::kTime) != nullptr;
    if (!is_one_side || places.axes[0] == nullptr || places.axes[1] == nullptr) continue;
    const auto sides = sidesTouched(dataset, places);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto shift = [&](const Places&, std::size_t row) {
        const auto& side = sides[row];
        const double around = 3 * std::atan2(side.y(), side.x());
        return 3 * kMm_um * (sine ? std::sin(around) : std::cos(around)) * side.head<2>().norm() *
               side[static_cast<Eigen::Index>(axis)];
      };
      std::ranges::move(along(axis, {places}, shift), std::back_inserter(moved));
    }
  }
  return moved;
}

const Column* angleOfC(const Table& table) {
  const auto found = std::ranges::find_if(table.columns, [](const Column& each) {
    return each.name.starts_with("C_") && (isInRadians(each.name) || isInDegrees(each.name));
  });
  return found == table.columns.end() ? nullptr : &*found;
}

// What C runs out, 2 um twice a turn; cosine or sine.
std::vector<Table> byErrorMotion(std::size_t axis, const std::vector<Places>& all, bool sine) {
  return along(axis, all, [&](const Places& places, std::size_t row) {
    const auto* c = axis < 2 ? angleOfC(*places.table) : nullptr;
    if (c == nullptr) return 0.0;
    const double twice = 2 * c->values[row] * (isInDegrees(c->name) ? kDegree : 1);
    return 2 * kMm_um * (sine ? std::sin(twice) : std::cos(twice));
  });
}

// A gain that bends by 1 % at the largest deflection.
std::vector<Table> byDeflection(const Dataset& dataset, const Method& method) {
  std::vector<Table> bent;
  for (const auto& table : dataset.tables) {
    Table changes{table.name, {}};
    for (const auto& column : table.columns) {
      if (columnOf(method, table.name, column.name).role != ColumnRole::deflection) continue;
      double most = 0;
      for (const double value : column.values) most = std::max(most, std::abs(value));
      changes.columns.push_back(column);
      for (double& value : changes.columns.back().values) value *= most > 0 ? 0.01 * std::abs(value) / most : 0;
    }
    if (!changes.columns.empty()) bent.push_back(std::move(changes));
  }
  return bent;
}

// Side on which an axis stands within its lost motion, from -1 to 1, sample by sample.
std::vector<double> sidesOf(const std::vector<double>& positions, const std::vector<double>* runs) {
  std::vector<double> sides;
  double side = 0, from = 0, turn = 0, farthest = 0, direction = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const double at = positions[k];
    if (k == 0 || (runs != nullptr && (*runs)[k] != (*runs)[k - 1])) {
      side = from = direction = 0;
      turn = farthest = at;
    } else if (direction == 0 ? std::abs(at - turn) > kReversal_mm : (farthest - at) * direction > kReversal_mm) {
      if (direction != 0) turn = farthest;
      direction = at > turn ? 1 : -1;
      from = side;
      farthest = at;
    } else if ((at - farthest) * direction > 0) {
      farthest = at;
    }
    const double taken_up = (std::abs(farthest - turn) - kReversal_mm) / kTakenUp_mm;
    side = from + (direction - from) * std::clamp(taken_up, 0.0, 1.0);
    sides.push_back(side);
  }
  return sides;
}

// Of every stream of positions, all axes together.
std::vector<Table> byMotion(const Dataset& dataset, const Method& method) {
  std::vector<Table> moved;
  for (const auto& table : dataset.tables) {
    if (table.column(column::kTime) == nullptr || described(method, table) == nullptr) continue;
    const auto* runs = table.column(column::kTouch);
    if (runs == nullptr) runs = table.column(column::kScan);
    Table shifts{table.name, {}};
    for (const auto& column : table.columns) {
      if (!axisOf(columnOf(method, table.name, column.name))) continue;
      shifts.columns.push_back({column.name, sidesOf(column.values, runs)});
      for (double& value : shifts.columns.back().values) value *= kMm_um / 2;
    }
    if (!shifts.columns.empty()) moved.push_back(std::move(shifts));
  }
  return moved;
}

// Whether the machine of a stream has joints in place of axes.
bool isOfJoints(const Dataset& dataset, const Method& method) {
  const auto knows_lost_motion = [](const KnownQuantity& known) { return known.key == quantity::kLostMotion.key; };
  return std::ranges::any_of(method.known, knows_lost_motion) && placesOf(dataset, method, true).empty();
}

// Ways in and out together lean on the lost motion that is known, ways out alone on the size.
TypeBInput ofJoints(double sd_mm) {
  const auto move = [sd_mm](Dataset& moved, double by) {
    auto& lost = moved.config[std::string{quantity::kLostMotion.key}];
    const auto* known = std::get_if<double>(&lost);
    lost = (known != nullptr ? *known : 0) + by * sd_mm;
    const auto size = moved.config.find("effective_diameter_mm");
    if (size != moved.config.end()) std::get<double>(size->second) += by * sd_mm;
  };
  return {.name = kLostMotionError.key, .sd = sd_mm, .move = move};
}

bool isNothing(const std::vector<Table>& moved) {
  return std::ranges::all_of(moved, [](const Table& table) {
    return std::ranges::all_of(table.columns, [](const Column& column) {
      return std::ranges::all_of(column.values, [](double value) { return value == 0; });
    });
  });
}

// With stamps that run on: where those of each touch count from its own beginning, by the order of the touches.
Table oneAfterTheOther(Table touched, double each_s) {
  auto& times = std::ranges::find(touched.columns, column::kTime.name, &Column::name)->values;
  if (std::ranges::adjacent_find(times, std::ranges::greater_equal{}) == times.end()) return touched;
  for (std::size_t row = 0; row < times.size(); ++row) times[row] = each_s * static_cast<double>(row);
  return touched;
}

// Touches as places that were read, each with its normal.
Places touchedPlaces(const Table& touched) {
  Places places{&touched, {}, {}, 0, true};
  const auto named = [&](const MethodColumn& column) {
    return &*std::ranges::find(touched.columns, column.name, &Column::name);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    places.axes.at(axis) = named(column::kPosition[axis]);
    places.normals.at(axis) = named(column::kNormal[axis]);
  }
  return places;
}

// The part of what touches are moved by that is along their normals, for one sd.
TypeBInput outwardsInput(std::string_view name, double sd, const std::vector<Table>& by_one, const Places& touches) {
  TypeBInput input{.name = std::string{name}, .sd = sd, .move = {}};
  input.outwards_mm.resize(touches.table->rows());
  for (const auto& [table, columns] : by_one) {
    const auto axis = std::ranges::find(column::kPosition, columns.front().name, &MethodColumn::name);
    const auto& normals = touches.normals.at(static_cast<std::size_t>(axis - column::kPosition))->values;
    for (std::size_t row = 0; row < normals.size(); ++row)
      input.outwards_mm[row] += sd * columns.front().values[row] * normals[row];
  }
  return input;
}

// Of a unit for each group of touches of one direction; of none that has a group before it.
std::vector<std::vector<double>> byDirection(const Places& touches) {
  const std::size_t count = touches.table->rows();
  const auto cosine = [&](std::size_t i, std::size_t k) {
    double sum = 0;
    for (const auto* normal : touches.normals) sum += normal->values[i] * normal->values[k];
    return sum;
  };
  std::vector<std::vector<double>> groups;
  std::vector<bool> is_in_group(count);
  for (std::size_t first = 0; first < count; ++first) {
    if (is_in_group[first]) continue;
    groups.emplace_back(count);
    for (std::size_t k = first; k < count; ++k) {
      if (is_in_group[k] || cosine(first, k) < kSameSideCosine) continue;
      is_in_group[k] = true;
      groups.back()[k] = 1;
    }
  }
  return groups;
}

class Inputs {
 public:
  // touches: those which `by_one` moves, in place of the readings of the case.
  Inputs(const Dataset& dataset, const MachineAccuracy& stated, const Places* touches = nullptr)
      : dataset_{dataset}, stated_{stated}, touches_{touches} {}

  void add(const MachineAccuracy::Key& error, std::vector<Table> by_one, bool whole = false) {
    if (isNothing(by_one)) return;
    const double sd = stated_.*error.member;
    add(error,
        touches_ != nullptr ? outwardsInput(error.key, sd, by_one, *touches_)
                            : movedInput(error.key, sd, std::move(by_one)),
        whole);
  }
  void add(const MachineAccuracy::Key& error, TypeBInput input, bool whole) {
    if (!(input.sd > 0)) return;
    input.of_machine = true;
    input.is_assumed = !dataset_.config.contains(error.key);
    input.whole_step = whole;
    all_.push_back(std::move(input));
  }
  void addPlaces(const std::vector<Places>& places, double reading_s) {
    for (std::size_t axis = 0; axis < 3 && !places.empty(); ++axis) {
      add(kScaleError, byLever(axis, axis, places));
      for (std::size_t lever = axis + 1; lever < 3; ++lever) add(kSquarenessError, byLever(axis, lever, places));
      add(kDriftError, byTime(axis, places, reading_s));
      add(kScaleError, byHalf(axis, places));
    }
  }
  std::vector<TypeBInput> all() && { return std::move(all_); }

 private:
  const Dataset& dataset_;
  const MachineAccuracy& stated_;
  const Places* touches_;
  std::vector<TypeBInput> all_;
};

Outcome<MachineAccuracy, Refusal> accuracyOf(const Dataset& dataset) {
  MachineAccuracy stated;
  for (const auto& [key, member, most, name, meaning] : kMachineErrors) {
    TRY(const auto number, configNumber(dataset, key));
    if (number && !(*number >= 0 && *number <= most))
      return Refusal{"bad-config", "config key '" + std::string{key} + "' is " + text(*number) +
                                       ": give a standard deviation (k = 1) from 0 to " + text(most)};
    if (number) stated.*member = *number;
  }
  return stated;
}

}  // namespace

Outcome<std::vector<TypeBInput>, Refusal> machineErrors(const Dataset& dataset, const Method& method) {
  TRY(const auto stated, accuracyOf(dataset));
  TRY(const auto reading_s, configPositive(dataset, kReadingTime));
  if (method.measures_machine) return std::vector<TypeBInput>{};
  Inputs inputs{dataset, stated};
  const auto places = placesOf(dataset, method);
  inputs.addPlaces(places, reading_s.value_or(kUsualReading_s));
  for (std::size_t axis = 0; axis < 3 && !places.empty(); ++axis) inputs.add(kLostMotionError, bySide(axis, places));
  // A smaller step would be lost in the choice of samples.
  const bool is_known = dataset.config.contains("sd_lost_motion_mm");
  if (!is_known) inputs.add(kLostMotionError, byMotion(dataset, method), true);
  if (!is_known && isOfJoints(dataset, method))
    inputs.add(kLostMotionError, ofJoints(stated.lost_motion_um * kMm_um), false);
  return std::move(inputs).all();
}

std::vector<TypeBInput> touchErrors(const Dataset& dataset, const Method& method, const Table& touched) {
  const auto stated = accuracyOf(dataset);
  const auto each_s = configPositive(dataset, kReadingTime);
  if (!stated || method.measures_machine || touched.rows() == 0) return {};
  const Table in_time = oneAfterTheOther(touched, each_s && *each_s ? **each_s : kUsualTouch_s);
  const Places touches = touchedPlaces(in_time);
  Inputs inputs{dataset, *stated, &touches};
  inputs.addPlaces({touches}, kUsualReading_s);
  for (auto& direction : byDirection(touches)) {
    const double sd = stated->probing_form_um;
    for (double& outwards : direction) outwards *= sd * kMm_um;
    inputs.add(kProbingFormError,
               {.name = kProbingFormError.key, .sd = sd, .move = {}, .outwards_mm = std::move(direction)}, false);
  }
  return std::move(inputs).all();
}

std::vector<TypeBInput> suspectedErrors(const Dataset& dataset, const Method& method) {
  constexpr MachineAccuracy kUsual;
  Inputs inputs{dataset, kUsual};
  const auto places = placesOf(dataset, method), along_streams = placesOf(dataset, method, true);
  const auto reading_s = configPositive(dataset, kReadingTime);
  for (const auto* of : {&places, &along_streams})
    inputs.addPlaces(*of, reading_s && *reading_s ? **reading_s : kUsualReading_s);
  for (std::size_t axis = 0; axis < 3; ++axis) inputs.add(kLostMotionError, bySide(axis, places));
  inputs.add(kLostMotionError, byMotion(dataset, method), true);
  auto all = std::move(inputs).all();
  for (const bool sine : {false, true}) {
    std::vector<Table> lobes;
    for (const auto* of : {&places, &along_streams})
      std::ranges::move(byLobes(dataset, *of, sine), std::back_inserter(lobes));
    if (!isNothing(lobes)) all.push_back(movedInput(kLobing, 1, std::move(lobes)));
  }
  for (const bool sine : {false, true}) {
    for (std::size_t axis = 0; axis < 2; ++axis)
      if (auto moved = byErrorMotion(axis, places, sine); !isNothing(moved))
        all.push_back(movedInput(kErrorMotion, 1, std::move(moved)));
  }
  if (auto bent = byDeflection(dataset, method); !isNothing(bent))
    all.push_back(movedInput(kCurvature, 1, std::move(bent)));
  return all;
}

std::size_t placesRead(const Dataset& dataset, const Method& method) {
  const auto places = placesOf(dataset, method);
  return places.empty() ? 0 : places.back().first + places.back().table->rows();
}

std::optional<std::string> assumedAccuracy(const std::vector<std::string>& names) {
  std::string values;
  const MachineAccuracy usual;
  for (const auto& error : kMachineErrors) {
    if (std::ranges::find(names, error.key) == names.end()) continue;
    values += (values.empty() ? "" : ", ") + std::string{error.key} + " " + text(usual.*error.member);
  }
  if (values.empty()) return std::nullopt;
  return "not stated: U holds that of a machine that nobody has measured, " + values +
         " (k = 1); state [accuracy] in machine.toml, or these keys in a case";
}

}  // namespace probebox::metrology
