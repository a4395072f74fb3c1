#include "tools/probebox/text/subject_words.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/methods.hpp"

namespace probebox::command {
namespace {

enum class Of { nothing, linear_axes, linear_axis, rotary_axis, tool, spindle };

struct Words {
  SubjectKind kind;
  std::string_view title;
  Of of;  // what follows the title
  std::string_view group;
};

constexpr auto kWords = std::to_array<Words>({
    {SubjectKind::delay, "Delay", Of::linear_axes, "delay"},
    {SubjectKind::delay_oblique, "Delay of axes that move together", Of::nothing, "delay"},
    {SubjectKind::delay_joints, "Delay by joint", Of::nothing, "delay"},
    {SubjectKind::pre_travel, "Pre-travel of the probe", Of::tool, "delay"},
    {SubjectKind::centreline, "Turning axis", Of::spindle, "axis"},
    {SubjectKind::centreline_slide, "Turning axis of the chuck on the slide", Of::nothing, "axis"},
    {SubjectKind::centreline_tip, "Turning axis from the stylus tip", Of::spindle, "axis"},
    {SubjectKind::stylus_offset, "Stylus offset", Of::tool, "axis"},
    {SubjectKind::spindle_offset, "Spindle offset", Of::nothing, "axis"},
    {SubjectKind::spindle_tilt, "Spindle tilt", Of::nothing, "axis"},
    {SubjectKind::tool, "Tool", Of::tool, "tool"},
    {SubjectKind::assembly, "Tool in its holder", Of::tool, "tool"},
    {SubjectKind::setter, "Tool setter", Of::nothing, "tool"},
    {SubjectKind::head_pivot, "Pivot of the head", Of::nothing, "head"},
    {SubjectKind::swivel, "Swivelling head", Of::rotary_axis, "head"},
    {SubjectKind::table_pivot, "Pivot of the table", Of::nothing, "table"},
    {SubjectKind::rotary, "Rotary axis", Of::rotary_axis, "table"},
    {SubjectKind::sensor_head, "Sensor head", Of::tool, "table"},
    {SubjectKind::screw, "Ball screw", Of::linear_axis, "screw"},
    {SubjectKind::screw_reference, "Cold ball screw", Of::linear_axis, "screw"},
    {SubjectKind::check, "Periodic check", Of::nothing, "machine"},
    {SubjectKind::machine, "Machine check", Of::nothing, "machine"},
});

const Words* wordsOf(SubjectKind kind) {
  const auto* found = std::ranges::find(kWords, kind, &Words::kind);
  return found == kWords.end() ? nullptr : found;
}

std::string letters(const Subject& subject, std::string_view names) {
  std::string all;
  for (std::size_t axis = 0; axis < names.size(); ++axis)
    if (subject.has(axis)) all += names[axis];
  return all;
}

std::string suffixOf(const Subject& subject, Of of) {
  switch (of) {
    case Of::nothing:
      return {};
    case Of::linear_axes:
      return subject.of == kAllAxes ? "" : " along " + letters(subject, "XYZ");
    case Of::linear_axis:
      return " " + letters(subject, "XYZ");
    case Of::rotary_axis:
      return " " + letters(subject, "ABC");
    case Of::spindle:
      return subject.of == 0 ? "" : " of spindle " + std::to_string(subject.of);
    case Of::tool:
      return subject.of == 0 ? "" : " " + std::to_string(subject.of);
  }
  return {};
}

}  // namespace

std::string subjectTitle(std::string_view subject) {
  const auto parsed = parseSubject(subject);
  const auto* words = parsed ? wordsOf(parsed->kind) : nullptr;
  if (words != nullptr) return std::string{words->title} + suffixOf(*parsed, words->of);
  std::string all{subject};
  std::ranges::replace(all, '-', ' ');
  return all;
}

std::string methodTitle(std::string_view method) {
  const auto* known = metrology::methodNamed(method);
  return std::string{known != nullptr && !known->title.empty() ? known->title : method};
}

std::string_view groupOf(const metrology::Method& method) {
  if (method.subject.about) {
    const auto* words = wordsOf(method.subject.about->kind);
    return words != nullptr ? words->group : "machine";
  }
  // The subject has the letter or the number of the case: its kind is in the name of the method.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kByName{{{"rotary", "table"},
                                                                                  {"table", "table"},
                                                                                  {"sensor-head", "table"},
                                                                                  {"swivel", "head"},
                                                                                  {"head", "head"},
                                                                                  {"tool", "tool"},
                                                                                  {"screw", "screw"}}};
  for (const auto& [begin, group] : kByName)
    if (method.name.starts_with(begin)) return group;
  return "machine";
}

}  // namespace probebox::command
