#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

// Least squares of many blocks of unknowns that are tied by common unknowns alone, such as the errors of an axis at
// each angle beside the place of the plate. The own unknowns of each block are eliminated by QR, the common ones solved
// from what is left (Schur complement): work and memory grow linearly with the blocks. Equal to leastSquares() of
// everything in one matrix.
namespace probebox::metrology {

// Residuals of the readings of one block with their derivatives, all divided by the sd of the reading.
struct BlockRows {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd own;     // by the unknowns of the block
  Eigen::MatrixXd common;  // by the common ones
};

// Unknowns: common ones first, then those of each block.
struct BlockUnknowns {
  Eigen::VectorXd common;
  std::vector<Eigen::VectorXd> own;
};

// Rows of block k. k one beyond the last block: the rows that see the common unknowns alone, without `own`.
using BlockModel = std::function<BlockRows(std::size_t block, const BlockUnknowns& at)>;

// Cofactor of the unknowns of blocks: own[k] of each by itself where the common ones are known, and carried[k] * common
// * carried[l]' between any two, which they share.
struct BlockCofactor {
  std::vector<Eigen::MatrixXd> own;
  std::vector<Eigen::MatrixXd> carried;
  Eigen::MatrixXd common;

  // Of the unknowns of block k.
  Eigen::MatrixXd of(std::size_t block) const;
  // Of values = rows * unknowns of all blocks, and of the unknowns of block k with these values. rows: few. Linear in
  // blocks, given `shared`.
  Eigen::MatrixXd of(const Eigen::MatrixXd& rows) const;
  // All blocks of one size.
  Eigen::MatrixXd with(std::size_t block, const Eigen::MatrixXd& rows, const Eigen::MatrixXd& shared) const;
  // Change of these values with the common unknowns.
  Eigen::MatrixXd shared(const Eigen::MatrixXd& rows) const;
};

struct BlockFit {
  BlockUnknowns unknowns;
  BlockCofactor cofactor;
  double condition{};  // of the column-scaled Jacobian of everything
  std::size_t dof{};
};

// Minimises the squares of all residuals from `start` on, under the rules of leastSquares(). Every block has unknowns
// of its own. Refuses: not-finite, too-few-readings (also of a block), ill-conditioned, no-convergence.
Outcome<BlockFit, Refusal> leastSquaresInBlocks(const BlockModel& model, const BlockUnknowns& start);

}  // namespace probebox::metrology
