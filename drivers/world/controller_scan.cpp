// Scans: onto the surface, along it in contact, and off it.
#include <cmath>

#include "drivers/world/controller.hpp"
#include "drivers/world/places.hpp"

namespace probebox::world {

// Off the surface first.
void Controller::finish() {
  if (!pressing_) return askAnew();
  machine_.moveTo(offSurface(), step_.nominal_speed_mm_s, now_);
  enter(Activity::leaving);
}

void Controller::enterScan() {
  way_ = 0;
  scan_rad_ = step_.scan.start_rad;
  pressing_ = true;
  machine_.moveTo(onScan(step_.scan.depths_mm[0]), step_.nominal_speed_mm_s, now_);
  enter(Activity::entering);
}

void Controller::scan() {
  if (!machine_.atRest(now_)) {
    entered_ = now_;
    return;
  }
  if (activity_ == Activity::leaving) {
    pressing_ = false;
    return askAnew();
  }
  if (activity_ == Activity::entering) {
    if (elapsed(config_.dwell())) post(MarkerPhase::begin, Activity::beginning);
    return;
  }
  if (!nextWay()) enter(Activity::recording);
}

// Exact stops between the ways.
bool Controller::nextWay() {
  if (way_ >= waysOf(step_.scan)) return false;
  const ScanWay way = wayOf(step_.scan, way_++);
  scan_rad_ += way.turn_rad;
  if (way.is_arc) return machine_.slideRound(place().centre, way.turn_rad, step_.nominal_speed_mm_s, now_);
  return machine_.slideTo(onScan(way.to_depth_mm), step_.nominal_speed_mm_s, now_);
}

// Where the centre of the stylus ball is to be for a depth, from where the scan has come to.
Vector3 Controller::onScan(double depth_mm) const {
  const Place at = place();
  const double radius_mm = at.keep_out_mm - config_.safe_distance_mm - depth_mm;
  return at.centre + radius_mm * Vector3{std::cos(scan_rad_), std::sin(scan_rad_), 0};
}

Vector3 Controller::offSurface() const {
  const Place at = place();
  const double distance_mm = at.keep_out_mm - config_.safe_distance_mm + step_.clearance_mm;
  return at.centre + distance_mm * unit(machine_.commandedPosition() - at.centre);
}

}  // namespace probebox::world
