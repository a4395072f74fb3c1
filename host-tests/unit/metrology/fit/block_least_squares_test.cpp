// Blocks of unknowns that common ones tie: the answer of one matrix, for work that grows with the blocks.
#include "firmware/metrology/fit/block_least_squares.hpp"

#include <gtest/gtest.h>
#include <random>

#include "firmware/metrology/fit/least_squares.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kOwn = 3, kCommon = 4, kRows = 5;

// Rows of each block, slightly bent, and of the common unknowns alone in the last one.
struct Bent {
  std::vector<BlockRows> rows;
  mutable std::size_t calls{};

  BlockRows operator()(std::size_t block, const BlockUnknowns& at) const {
    ++calls;
    BlockRows found = rows[block];
    const bool has_own = block < at.own.size();
    VectorXd straight = found.common * at.common;
    if (has_own) straight += found.own * at.own[block];
    found.residuals = straight + 0.05 * straight.cwiseProduct(straight) - rows[block].residuals;
    const VectorXd slope = (1.0 + 0.1 * straight.array()).matrix();
    found.common = slope.asDiagonal() * found.common;
    if (has_own) found.own = slope.asDiagonal() * found.own;
    return found;
  }
};

Bent randomBlocks(std::size_t blocks, std::mt19937_64& random) {
  std::uniform_real_distribution<double> any{-1, 1};
  const auto matrix = [&](Index rows, Index columns) {
    return MatrixXd{MatrixXd::NullaryExpr(rows, columns, [&] { return any(random); })};
  };
  Bent bent;
  for (std::size_t k = 0; k < blocks; ++k)
    bent.rows.push_back({0.2 * matrix(kRows, 1), matrix(kRows, kOwn), matrix(kRows, kCommon)});
  bent.rows.push_back({0.2 * matrix(kCommon, 1), MatrixXd{kCommon, 0}, matrix(kCommon, kCommon)});
  return bent;
}

BlockUnknowns zeros(std::size_t blocks) {
  return {VectorXd::Zero(kCommon), std::vector(blocks, VectorXd{VectorXd::Zero(kOwn)})};
}

// Everything in one matrix: the common unknowns first.
Linearised inOne(const Bent& bent, const VectorXd& parameters) {
  const auto blocks = bent.rows.size() - 1;
  BlockUnknowns at{parameters.head(kCommon), {}};
  for (std::size_t k = 0; k < blocks; ++k)
    at.own.emplace_back(parameters.segment(kCommon + static_cast<Index>(k) * kOwn, kOwn));
  const auto rows = static_cast<Index>(blocks) * kRows + kCommon;
  Linearised all{VectorXd{rows}, MatrixXd::Zero(rows, parameters.size())};
  Index row = 0;
  for (std::size_t k = 0; k <= blocks; ++k) {
    const auto [residuals, own, common] = bent(k, at);
    all.residuals.segment(row, residuals.size()) = residuals;
    all.jacobian.block(row, 0, residuals.size(), kCommon) = common;
    all.jacobian.block(row, kCommon + static_cast<Index>(k) * kOwn, residuals.size(), own.cols()) = own;
    row += residuals.size();
  }
  return all;
}

TEST(BlockLeastSquares, AnswersAsOneMatrixDoes) {
  std::mt19937_64 random{4};
  for (const std::size_t blocks : {1U, 2U, 9U}) {
    const Bent bent = randomBlocks(blocks, random);
    const auto size = kCommon + static_cast<Index>(blocks) * kOwn;
    const auto dense =
        leastSquares([&](const VectorXd& at) { return inOne(bent, at); }, VectorXd::Zero(size), Outliers::keep);
    const auto found = leastSquaresInBlocks(std::cref(bent), zeros(blocks));
    ASSERT_TRUE(dense.ok() && found.ok());
    EXPECT_EQ(found->dof, dense->dof);
    EXPECT_NEAR(found->condition, dense->condition, 1e-9 * dense->condition);
    EXPECT_LT((found->unknowns.common - dense->parameters.head(kCommon)).norm(), 1e-10);
    EXPECT_LT((found->cofactor.common - dense->cofactor.topLeftCorner(kCommon, kCommon)).norm(),
              1e-9 * dense->cofactor.norm());
    const MatrixXd rows = MatrixXd::NullaryExpr(2, size - kCommon, [&] {
      return std::uniform_real_distribution<double>{-1, 1}(random);
    });
    const MatrixXd of_own = dense->cofactor.bottomRightCorner(size - kCommon, size - kCommon);
    EXPECT_LT((found->cofactor.of(rows) - rows * of_own * rows.transpose()).norm(), 1e-9 * of_own.norm());
    for (std::size_t k = 0; k < blocks; ++k) {
      const Index at = static_cast<Index>(k) * kOwn;
      EXPECT_LT((found->unknowns.own[k] - dense->parameters.segment(kCommon + at, kOwn)).norm(), 1e-10);
      EXPECT_LT((found->cofactor.of(k) - of_own.block(at, at, kOwn, kOwn)).norm(), 1e-9 * of_own.norm());
      const auto with = found->cofactor.with(k, rows, found->cofactor.shared(rows));
      EXPECT_LT((with - of_own.middleRows(at, kOwn) * rows.transpose()).norm(), 1e-9 * of_own.norm());
    }
  }
}

TEST(BlockLeastSquares, RefusesUnknownsThatNoRowDetermines) {
  std::mt19937_64 random{5};
  Bent bent = randomBlocks(3, random);
  for (auto& rows : bent.rows) rows.common.col(1) = 2 * rows.common.col(0);
  EXPECT_EQ(leastSquaresInBlocks(std::cref(bent), zeros(3)).error().name, "ill-conditioned");
  bent = randomBlocks(3, random);
  bent.rows[1].own.col(2).setZero();
  EXPECT_EQ(leastSquaresInBlocks(std::cref(bent), zeros(3)).error().name, "ill-conditioned");
}

TEST(BlockLeastSquares, RefusesABlockWithFewerRowsThanUnknowns) {
  std::mt19937_64 random{7};
  Bent bent = randomBlocks(3, random);
  auto& [residuals, own, common] = bent.rows[1];
  residuals.conservativeResize(2);
  own.conservativeResize(2, Eigen::NoChange);
  common.conservativeResize(2, Eigen::NoChange);
  EXPECT_EQ(leastSquaresInBlocks(std::cref(bent), zeros(3)).error().name, "too-few-readings");
}

TEST(BlockLeastSquares, AsksEachBlockEquallyOftenHoweverManyThereAre) {
  std::mt19937_64 random{6};
  const auto callsOf = [&](std::size_t blocks) {
    const Bent bent = randomBlocks(blocks, random);
    EXPECT_TRUE(leastSquaresInBlocks(std::cref(bent), zeros(blocks)).ok());
    return static_cast<double>(bent.calls) / static_cast<double>(blocks + 1);
  };
  EXPECT_LE(callsOf(400), 1.5 * callsOf(100));
}

}  // namespace
}  // namespace probebox::metrology
