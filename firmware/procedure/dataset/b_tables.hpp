#pragma once
#include <Eigen/Core>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"

// Tables and keys of the methods that turn B: tilting tables and swivelling heads.
namespace probebox::procedure {

// Vector from the gauge line to the tip of a tool of this length, by the control's nominal kinematics.
Eigen::Vector3d nominalTip(const HeadFacts& head, double b_rad, double length_mm);

// Adds the tables of table-pivot. Each angle of C is a separate point of the table, so errors of C do not matter.
void addTilts(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BFacts& table);

// Adds the tables of head-pivot. Each angle of A is a separate point of the head.
void addSwivels(metrology::Dataset& dataset, const std::vector<Reading>& readings, const HeadFacts& head);

// Names the assemblies in force whose lengths these tools have, so that a result rests on them. At most
// kMostProbeTools.
void addLengthResults(metrology::Dataset& dataset, const Facts& facts, const std::vector<std::uint32_t>& probe_tools);
// Numbers of the tools in the readings, each once, in the order in which they were read.
std::vector<std::uint32_t> toolsOf(const std::vector<Reading>& readings);

// Adds the tables of swivel-error: the ball's centre as a control with nominal kinematics reports it, for every angle
// of B and every tool, averaged over half a turn of A.
void addSwivelErrors(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts);

}  // namespace probebox::procedure
