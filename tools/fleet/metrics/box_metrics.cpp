#include "tools/fleet/metrics/box_metrics.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <concepts>
#include <cstdio>
#include <numbers>
#include <string>
#include <type_traits>
#include <utility>

#include "protocol/messages/fields.hpp"
#include "protocol/state/kind_of_value.hpp"
#include "protocol/state/shown_when.hpp"
#include "protocol/units/calendar.hpp"

namespace probebox::fleet {
namespace {

using published::Complaint;
using published::Counter;
using published::Each;
using published::Identifier;
using Labels = std::vector<Label>;

struct Unit {
  std::string_view suffix;  // of the field
  std::string_view si;      // of the metric
  double per_si;            // so many are one SI unit
  std::string_view text;    // with which the meaning of the field begins
};
// Longer suffixes first.
constexpr Unit kUnits[]{
    {"_mm_mm", "_ratio", 1, "mm/mm"},   {"_ns", "_seconds", 1e9, "ns"},
    {"_us", "_seconds", 1e6, "us"},     {"_ms", "_seconds", 1e3, "ms"},
    {"_ps", "_seconds", 1e12, "ps"},    {"_s", "_seconds", 1, "s"},
    {"_nm", "_metres", 1e9, "nm"},      {"_um", "_metres", 1e6, "um"},
    {"_mm", "_metres", 1e3, "mm"},      {"_mrad", "_radians", 1e3, "mrad"},
    {"_rad", "_radians", 1, "rad"},     {"_deg", "_radians", 180 / std::numbers::pi, "deg"},
    {"_ppm", "_ratio", 1e6, "1e-6"},    {"_ppb", "_ratio", 1e9, "1e-9"},
    {"_percent", "_ratio", 1e2, "%"},   {"_hz", "_hertz", 1, "Hz"},
    {"_c", "_celsius", 1, "degrees C"}, {"_k", "_kelvins", 1, "K"},
};
// A place and an orientation in one array: mm along X Y Z, then rad about them.
constexpr std::string_view kPose = "_mm_rad";

const Unit* unitOf(std::string_view name) {
  const auto* unit = std::ranges::find_if(kUnits, [&](const Unit& each) { return name.ends_with(each.suffix); });
  return unit == std::end(kUnits) ? nullptr : unit;
}

// The unit at the beginning is that of the field, not of the metric.
std::string_view withoutUnit(std::string_view meaning, const Unit& unit) {
  if (!meaning.starts_with(unit.text)) return meaning;
  const auto rest = meaning.substr(unit.text.size());
  if (rest.starts_with(", ") || rest.starts_with("; ")) return rest.substr(2);
  return rest.starts_with(" ") ? rest.substr(1) : meaning;
}

bool holds(const auto&) {
  return true;
}
bool holds(const published::NullUnless& null) {
  return null.condition;
}
bool holds(const published::OmittedUnless& omitted) {
  return omitted.condition;
}

template <class Kind, class... Kinds>
inline constexpr bool kIs = (std::same_as<Kind, Kinds> || ...);

// Label of the elements of a list: of cnc_lines "line".
std::string singular(std::string_view name) {
  const auto last = name.substr(name.rfind('_') + 1);
  return std::string{last.ends_with('s') ? last.substr(0, last.size() - 1) : last};
}

// Where a value stands: in metrics "probebox_clock_edges", in JSON "clock.edges".
struct Place {
  std::string metric;
  std::string json;
  Place of(std::string_view field) const {
    return {metric + "_" + std::string{field}, (json.empty() ? "" : json + ".") + std::string{field}};
  }
};

class Walk {
 public:
  explicit Walk(Exposition& to) : to_{to} {}

  template <messages::Structure T>
  void structure(const T& value, const Place& place, const Labels& labels) {
    T::fields(value, [&]<class... Kinds>(std::string_view name, const auto& member, std::string_view meaning,
                                         const Kinds&... kinds) {
      if constexpr (!kIs<Identifier, Kinds...>) {
        if ((holds(kinds) && ...)) field(name, member, meaning, place.of(name), labels, kinds...);
      }
    });
  }

 private:
  template <class T, class... Kinds>
  void field(std::string_view name, const T& member, std::string_view meaning, const Place& place, const Labels& labels,
             const Kinds&... kinds) {
    constexpr auto kType = kIs<Counter, Kinds...> ? MetricType::counter : MetricType::gauge;
    if constexpr (messages::Text<T>) {
      if constexpr (kIs<Complaint, Kinds...>)
        number(place, "1 while there is one: " + std::string{meaning}, kType, labels, member.empty() ? 0 : 1);
    } else if constexpr (messages::Structure<T>) {
      structure(member, place, labels);
    } else if constexpr (messages::detail::kIsArray<T>) {
      Each each{"index"};
      (assign(each, kinds), ...);
      for (std::size_t k = 0; k < member.size(); ++k) {
        const auto own = with(labels, each.label, each.name ? std::string{each.name(k)} : std::to_string(k));
        element(name, member[k], 2 * k >= member.size(), meaning, place, own, kType);
      }
    } else if constexpr (messages::detail::kIsVector<T>) {
      list(name, member, meaning, place, labels);
    } else {
      number(place, meaning, kType, labels, valueOf(member));
    }
  }

  template <class T>
  void element(std::string_view name, const T& value, bool second_half, std::string_view meaning, const Place& place,
               const Labels& labels, MetricType type) {
    if constexpr (messages::Structure<T>) {
      structure(value, place, labels);
    } else if (name.ends_with(kPose)) {
      auto own = place;
      own.metric.resize(own.metric.size() - kPose.size());
      own.metric += second_half ? "_rad" : "_mm";
      number(own, meaning, type, labels, valueOf(value));
    } else {
      number(place, meaning, type, labels, valueOf(value));
    }
  }

  template <class T>
  void list(std::string_view name, const std::vector<T>& elements, std::string_view meaning, const Place& place,
            const Labels& labels) {
    if constexpr (messages::Structure<T>) {
      if (hasNumbers<T>()) {
        for (std::size_t k = 0; k < elements.size(); ++k)
          structure(elements[k], place, with(labels, singular(name), nameOf(elements, k)));
        return;
      }
    }
    number(place, "number of them: " + std::string{meaning}, MetricType::gauge, labels,
           static_cast<double>(elements.size()));
  }

  // Two of the same name are told apart by their order.
  template <class T>
  static std::string nameOf(const std::vector<T>& elements, std::size_t k) {
    if constexpr (requires { elements[k].name; }) {
      const auto end = elements.begin() + static_cast<std::ptrdiff_t>(k);
      const auto before = std::ranges::count(elements.begin(), end, elements[k].name, &T::name);
      return elements[k].name + (before == 0 ? "" : " (" + std::to_string(before + 1) + ")");
    } else {
      return std::to_string(k);
    }
  }

  // Whether the elements of a list have more to say than names.
  template <class T>
  static bool hasNumbers() {
    bool any = false;
    T none{};
    T::fields(none, [&]<class Member, class... Kinds>(auto, const Member&, auto, const Kinds&...) {
      any = any || (!kIs<Identifier, Kinds...> && (!messages::Text<Member> || kIs<Complaint, Kinds...>));
    });
    return any;
  }

  template <class T>
  static double valueOf(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      return static_cast<double>(static_cast<std::underlying_type_t<T>>(value));
    } else if constexpr (requires { value.index; }) {
      return static_cast<double>(value.index);
    } else {
      return static_cast<double>(value);
    }
  }

  static void assign(Each& each, const auto& kind) {
    if constexpr (std::same_as<std::decay_t<decltype(kind)>, Each>) each = kind;
  }

  static Labels with(Labels labels, std::string_view name, std::string value) {
    labels.push_back({std::string{name}, std::move(value)});
    return labels;
  }

  void number(const Place& place, std::string_view meaning, MetricType type, const Labels& labels, double value) {
    auto name = place.metric;
    if (const auto* unit = unitOf(name)) {
      name.resize(name.size() - unit->suffix.size());
      name += unit->si;
      meaning = withoutUnit(meaning, *unit);
      value /= unit->per_si;
    }
    if (type == MetricType::counter) name += "_total";
    to_.add(name, std::string{meaning} + " (" + place.json + ")", type, labels, value);
  }

  Exposition& to_;
};

void addTimestamp(Exposition& to, const char* name, const char* help, const std::string& subject,
                  const std::string& text) {
  if (const auto time = timeOf(text))
    to.add(name, help, MetricType::gauge, {{"subject", subject}},
           static_cast<double>(time->time_since_epoch().count()));
}

void addResult(Exposition& to, const messages::ResultSummary& result) {
  const std::size_t about = result.about_count == 0 ? result.values.size() : result.about_count;
  for (std::size_t k = 0; k < std::min({about, result.values.size(), kMostValuesOfAResult}); ++k) {
    const auto& value = result.values[k];
    const Labels labels{{"subject", result.subject}, {"key", value.key}};
    to.add("probebox_result_value", "of the result in force, in the unit that its key ends with", MetricType::gauge,
           labels, value.value);
    if (const auto u = value.uncertainty())
      to.add("probebox_result_u", "standard uncertainty (k = 1) of that value, the same unit", MetricType::gauge,
             labels, *u);
  }
  addTimestamp(to, "probebox_result_timestamp_seconds", "when the result in force was measured", result.subject,
               result.proposed_utc);
}

}  // namespace

void addBox(Exposition& to, const Observed* box) {
  to.add("probebox_up", "1 while the box answers", MetricType::gauge, {}, box == nullptr ? 0 : 1);
  if (box == nullptr) return;
  const auto& is = box->descriptor;
  to.add("probebox_info", "always 1: which box this is, and what it runs", MetricType::gauge,
         {{"serial_number", is.serial_number},
          {"board", is.board},
          {"firmware_version", is.firmware_version},
          {"machine", is.machine},
          {"probe", is.probe}},
         1);
  Walk walk{to};
  walk.structure(box->status, {"probebox", ""}, {});
  if (box->corrections) walk.structure(*box->corrections, {"probebox_corrections", "corrections"}, {});
  for (const auto& result : box->in_force) addResult(to, result);
  if (!box->unit) return;
  for (const auto& sphere : box->unit->sphere)
    addTimestamp(to, "probebox_certificate_due_timestamp_seconds", "the first day without a valid calibration",
                 "sphere", sphere.next_due);
}

}  // namespace probebox::fleet
