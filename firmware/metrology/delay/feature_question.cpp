#include "firmware/metrology/delay/feature_question.hpp"

#include <array>
#include <string_view>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/configured_direction.hpp"
#include "firmware/metrology/dataset/configured_gain.hpp"
#include "firmware/metrology/scan/shape.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, 2> kDelaysOfAxes{"common", "each-axis"};

Refusal badConfig(const std::string& what) {
  return {"bad-config", what};
}

std::optional<Refusal> readSizes(const Dataset& dataset, FeatureQuestion& question) {
  TRY(const auto size, configPositive(dataset, "size_mm"));
  TRY(const auto box, configVector(dataset, "size_axis_mm"));
  const bool is_box = question.shape == "box";
  if (is_box != box.has_value()) {
    return badConfig(is_box ? "a box needs the config key 'size_axis_mm': its effective size along x, y and z"
                            : "config key 'size_axis_mm' is for a box only");
  }
  if (size.has_value() && !question.sized())
    return badConfig("config key 'size_mm' does not describe a " + question.shape);
  question.size_mm = size;
  if (is_box) question.box_mm = Vector3d::Map(box->data());
  if (is_box && !(question.box_mm.minCoeff() > 0.0))
    return badConfig("config key 'size_axis_mm': the sizes of the box must be positive, in mm: correct them");
  return std::nullopt;
}

}  // namespace

Outcome<FeatureQuestion, Refusal> featureQuestion(const Dataset& dataset) {
  FeatureQuestion question;
  TRY(const auto shape, requiredShape(dataset));
  question.shape = shape;
  TRY(const auto axis, configDirection(dataset, "axis_direction"));
  if (axis.has_value() != (question.shape == "cylinder")) {
    return badConfig("config key 'axis_direction' is required for a cylinder and not allowed for other shapes");
  }
  question.axis = axis.value_or(question.axis);
  if (auto bad = readSizes(dataset, question)) return *bad;
  TRY(const auto delays, configWord(dataset, "delays", kDelaysOfAxes));
  question.each_axis = delays.value_or("common") == "each-axis";
  TRY(const auto own, configSwitch(dataset, "article_has_own_delay"));
  question.own_article = own;
  if (question.own_article && !dataset.table("article")) {
    return Refusal{"missing-table", "article_has_own_delay needs the table 'article', where the workpiece was"};
  }
  TRY(const auto threshold, configPositive(dataset, "threshold_mm"));
  question.threshold_mm = threshold;
  TRY(const auto gain, configGain(dataset));
  question.gain = gain;
  return question;
}

}  // namespace probebox::metrology
