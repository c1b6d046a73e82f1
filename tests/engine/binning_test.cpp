// How the builder of a wide tree splits: against the heuristic written down once more, in double precision and slowly.
#include "engine/accel/binning.h"

#include <doctest/doctest.h>

#include <vector>

#include "tests/robustness/worlds.h"

using namespace penumbra;
using accel::bin_count;

namespace {

std::vector<accel::Reference> random_references(test::Random& random) {
  std::vector<accel::Reference> references(static_cast<std::size_t>(2 + random.below(100)));
  const bool is_flat = random.below(4) == 0;
  for (std::uint32_t i = 0; i < references.size(); ++i) {
    accel::Reference& r = references[i];
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = is_flat && axis == 1 ? 2 : random.between(-5, 5) * (random.below(8) == 0 ? 10 : 1);
      r.box.lower[axis] = static_cast<float>(lower);
      r.box.minus_upper[axis] = -static_cast<float>(lower + (is_flat && axis == 1 ? 0 : random.between(0, 1)));
    }
    r.box.lower[3] = std::bit_cast<float>(i);
    r.box.minus_upper[3] = std::bit_cast<float>(static_cast<std::uint32_t>(random.below(3)));
  }
  return references;
}

double half_area(const std::vector<accel::Reference>& references, const std::vector<std::size_t>& some) {
  double low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = math::infinity, high[axis] = -math::infinity;
    for (const std::size_t i : some) {
      low[axis] = std::min(low[axis], double{references[i].box.lower[axis]});
      high[axis] = std::max(high[axis], -double{references[i].box.minus_upper[axis]});
    }
  }
  const double x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
  return x * y + y * z + z * x;
}

struct Sides {
  std::vector<std::size_t> left, right;
  double cost(const std::vector<accel::Reference>& references) const {
    if (left.empty() || right.empty()) return math::infinity;
    return half_area(references, left) * static_cast<double>(left.size()) +
           half_area(references, right) * static_cast<double>(right.size());
  }
};

/// By the sixteenth of the centers' extent that a center lies in.
Sides sides_of(const std::vector<accel::Reference>& references, const accel::Binning& binning, int axis, int bin) {
  Sides sides;
  for (std::size_t i = 0; i < references.size(); ++i) {
    const float place = (references[i].doubled_center(axis) - binning.lower[axis]) * binning.scale[axis];
    (place < static_cast<float>(bin) ? sides.left : sides.right).push_back(i);
  }
  return sides;
}

}  // namespace

TEST_CASE("the extent of entries is that of each of them") {
  test::Random random(5);
  for (int round = 0; round < 200; ++round) {
    std::vector<accel::Reference> references = random_references(random);
    const accel::Extent extent = accel::extent_of(references);
    std::size_t others = 0;
    for (int axis = 0; axis < 3; ++axis) {
      float lower = math::float_infinity, upper = -lower, first = lower, last = -lower;
      for (const accel::Reference& r : references) {
        lower = std::min(lower, r.box.lower[axis]), upper = std::max(upper, -r.box.minus_upper[axis]);
        first = std::min(first, r.doubled_center(axis)), last = std::max(last, r.doubled_center(axis));
      }
      CHECK(extent.box.lower[axis] == lower);
      CHECK(-extent.box.minus_upper[axis] == upper);
      CHECK(extent.centers.lower[axis] == first);
      CHECK(-extent.centers.minus_upper[axis] == last);
    }
    for (const accel::Reference& r : references) others += r.shape() == accel::Shape::other ? 1 : 0;
    CHECK(extent.others == others);
  }
}

TEST_CASE("the split chosen is the cheapest of all, and entries go to its sides in their order") {
  test::Random random(6);
  for (int round = 0; round < 300; ++round) {
    std::vector<accel::Reference> references = random_references(random);
    const accel::Binning binning(accel::extent_of(references).centers);
    const std::size_t half = references.size() / 2;
    accel::Bins bins = accel::bins_of(std::span(references).first(half), binning);
    bins.include(accel::bins_of(std::span(references).subspan(half), binning));
    for (int axis = 0; axis < 3; ++axis) {
      std::int32_t count = 0;
      for (std::size_t bin = 0; bin < bin_count; ++bin) count += bins.count[bin][axis];
      CHECK(count == static_cast<std::int32_t>(references.size()));
    }
    const accel::Split split = accel::best_split(bins);
    double least = math::infinity;
    for (int axis = 0; axis < 3; ++axis) {
      for (int bin = 1; bin < static_cast<int>(bin_count); ++bin)
        least = std::min(least, sides_of(references, binning, axis, bin).cost(references));
    }
    REQUIRE(split.axis >= 0);
    const Sides sides = sides_of(references, binning, split.axis, split.bin);
    CHECK(sides.cost(references) <= least * (1 + 1e-5));
    CHECK(static_cast<double>(split.cost) == doctest::Approx(least).epsilon(1e-5));
    std::vector<accel::Reference> parted(references.size());
    CHECK(accel::partition(references, binning, bins, split, parted.data()) == sides.left.size());
    std::vector<std::size_t> order = sides.left;
    order.insert(order.end(), sides.right.begin(), sides.right.end());
    for (std::size_t i = 0; i < order.size(); ++i) {
      CHECK(parted[i].index() == references[order[i]].index());
      CHECK(parted[i].shape() == references[order[i]].shape());
    }
  }
}

TEST_CASE("entries with one center cannot be split") {
  test::Random random(7);
  std::vector<accel::Reference> references = random_references(random);
  for (accel::Reference& r : references) {
    for (int axis = 0; axis < 3; ++axis) {
      const float half = 0.25F * static_cast<float>(1 + random.below(8));
      r.box.lower[axis] = 1 - half, r.box.minus_upper[axis] = -(1 + half);
    }
  }
  const accel::Binning binning(accel::extent_of(references).centers);
  CHECK(accel::best_split(accel::bins_of(references, binning)).axis < 0);
}
