#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

void append(std::vector<Plot>& all, std::vector<Plot> more) {
  for (auto& plot : more) {
    if (!plot.empty()) all.push_back(std::move(plot));
  }
}

std::vector<Plot> ofRefusal(const metrology::Dataset& dataset) {
  std::vector<Plot> all;
  append(all, rawStreamPictures(dataset));
  if (all.empty()) append(all, planePictures(dataset, nullptr));
  if (all.empty()) append(all, tablePictures(dataset));
  return all;
}

}  // namespace

std::vector<Plot> pictures(const Subject& subject) {
  const auto* result = subject.result();
  if (result == nullptr) return subject.dataset ? ofRefusal(*subject.dataset) : std::vector<Plot>{};
  std::vector<Plot> all;
  append(all, sizePictures(subject));
  append(all, formPictures(*result));
  append(all, screwPictures(subject));
  append(all, rotaryPictures(subject));
  if (subject.dataset) {
    append(all, streamPictures(*subject.dataset, *result));
    append(all, turnPictures(*subject.dataset, *result));
    append(all, swivelPictures(*subject.dataset, *result));
    append(all, planePictures(*subject.dataset, result));
  }
  append(all, residualPictures(*result));
  if (all.empty() && subject.dataset) append(all, tablePictures(*subject.dataset));
  return all;
}

}  // namespace probebox::report
