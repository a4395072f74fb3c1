#pragma once
#include <Eigen/Core>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"

// Tables and keys of the methods that turn B: a table that tilts, a head that swivels.
namespace probebox::procedure {

// From the gauge line to the tip of a tool of that length, as the control takes it to be.
Eigen::Vector3d nominalTip(const HeadFacts& head, double b_rad, double length_mm);

// table-pivot. Each angle of C is a point of the table with a place of its own, so what C stops beside its angle does
// not matter.
void addTilts(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BFacts& table);

// head-pivot. Each angle of A is a point of the head, likewise.
void addSwivels(metrology::Dataset& dataset, const std::vector<Reading>& readings, const HeadFacts& head);

// swivel-error: the ball's centre as a control with the nominal kinematics reports it, at every angle of B with every
// tool, half a turn of A averaged out.
void addSwivelErrors(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts);

}  // namespace probebox::procedure
