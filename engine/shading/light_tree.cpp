#include "engine/shading/light_tree.h"

#include <algorithm>
#include <cmath>

namespace penumbra::shading {
namespace {

constexpr std::size_t word_bits = 64;
/// So many may be drawn however few are taken; else about as many as are.
constexpr std::size_t least_drawn = 16;

std::size_t words_for(std::size_t bits) { return (bits + word_bits - 1) / word_bits; }
void set_bit(std::vector<std::uint64_t>& words, std::size_t bit) {
  words[bit / word_bits] |= std::uint64_t{1} << bit % word_bits;
}

}  // namespace

LightTree::LightTree(const std::vector<Light>& lights) : always_(words_for(lights.size())) {
  std::vector<LightReach> reaches(lights.size());
  for (std::uint32_t i = 0; i < lights.size(); ++i) {
    if (const auto reach = reach_of(lights[i])) {
      reaches[i] = *reach;
      order_.push_back(i);
    } else {
      set_bit(always_, i);
    }
  }
  nodes_.reserve(2 * order_.size());
  if (!order_.empty()) build(reaches, 0, static_cast<std::uint32_t>(order_.size()));
}

std::uint32_t LightTree::build(const std::vector<LightReach>& reaches, std::uint32_t begin, std::uint32_t end) {
  const auto place = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({{}, begin, end});
  math::Bounds centers;
  for (std::uint32_t i = begin; i < end; ++i) {
    nodes_[place].reach.include(reaches[order_[i]]);
    centers.include(reaches[order_[i]].places.center());
  }
  if (end - begin == 1) return place;
  const Vec3 extent = centers.extent();
  const int axis = extent.x > extent.y ? (extent.x > extent.z ? 0 : 2) : (extent.y > extent.z ? 1 : 2);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double of_a = reaches[a].places.center()[axis], of_b = reaches[b].places.center()[axis];
                     return of_a < of_b || (of_a == of_b && a < b);
                   });
  build(reaches, begin, middle);
  nodes_[place].other = build(reaches, middle, end);
  return place;
}

void LightChoice::take_all(std::size_t lights) {
  taken_.assign(words_for(lights), ~std::uint64_t{0});
  if (lights % word_bits != 0) taken_.back() >>= word_bits - lights % word_bits;
  drawn_.clear();
  culled_ = unseen_ = 0;
}

void LightChoice::take(const LightTree& tree, const LitRegion& region, double error, const sampling::Key& key) {
  taken_ = tree.always_;
  taken_count_ = 0, culled_ = unseen_ = 0;
  open_.clear(), drawn_.clear();
  sort_out(tree, region, 2 * error * std::sqrt(static_cast<double>(least_drawn)));
  const std::size_t count = take_brightest(tree, region, error);
  if (count > 0) draw(tree, region, count, key);
}

void LightChoice::take(const LightTree& tree, const LightTree::Node& node) {
  for (std::uint32_t i = node.begin; i < node.end; ++i) set_bit(taken_, tree.order_[i]);
  taken_count_ += node.count();
}

void LightChoice::sort_out(const LightTree& tree, const LitRegion& region, double least) {
  pending_.assign(tree.nodes_.empty() ? 0 : 1, 0);
  while (!pending_.empty()) {
    const std::uint32_t place = pending_.back();
    const LightTree::Node& node = tree.nodes_[place];
    pending_.pop_back();
    if (!node.reach.may_light(region)) {
      culled_ += node.count();
    } else if (least > 0 && node.reach.most(region) <= least) {
      open(tree, region, place);
    } else if (node.is_leaf() || (!(least > 0) && node.reach.lights_for_certain(region))) {
      take(tree, node);
    } else {
      pending_.push_back(node.other), pending_.push_back(place + 1);
    }
  }
}

double LightChoice::open(const LightTree& tree, const LitRegion& region, std::uint32_t node) {
  const LightReach& reach = tree.nodes_[node].reach;
  const double most = reach.may_light(region) ? reach.most(region) : 0;
  if (most > 0) {
    open_.push_back({most, node});
  } else {
    culled_ += tree.nodes_[node].count();
  }
  return most;
}

std::size_t LightChoice::take_brightest(const LightTree& tree, const LitRegion& region, double error) {
  double sum = 0;
  for (const Open& open : open_) sum += open.most;
  std::make_heap(open_.begin(), open_.end());
  // What is drawn from a part adds between nothing and all that the part may add: it varies by a half of that at most.
  const auto needed = [&] { return 0.25 * (sum / error) * (sum / error); };
  while (!open_.empty() && needed() > static_cast<double>(std::max(least_drawn, taken_count_))) {
    std::pop_heap(open_.begin(), open_.end());
    const auto [most, place] = open_.back();
    const LightTree::Node& node = tree.nodes_[place];
    open_.pop_back();
    sum -= most;
    if (node.is_leaf()) {
      take(tree, node);
      continue;
    }
    for (const std::uint32_t child : {place + 1, node.other}) {
      const double more = open(tree, region, child);
      if (more > 0) std::push_heap(open_.begin(), open_.end());
      sum += more;
    }
  }
  std::size_t lights = 0;
  for (const Open& open : open_) lights += tree.nodes_[open.node].count();
  const std::size_t count = 2 * static_cast<std::size_t>(std::ceil(std::max(1.0, 0.5 * needed())));
  if (lights > count) {
    unseen_ = lights - count;
    return count;
  }
  for (const Open& open : open_) take(tree, tree.nodes_[open.node]);
  return 0;
}

void LightChoice::draw(const LightTree& tree, const LitRegion& region, std::size_t count, const sampling::Key& key) {
  // Side by side in the tree: what stands for others is near them.
  std::ranges::sort(open_, {}, &Open::node);
  double sum = 0;
  for (const Open& open : open_) sum += open.most;
  const double part = sum / static_cast<double>(count);
  double before = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double place = (static_cast<double>(i) + key.at(i).uniform(0)) * part;
    for (; at + 1 < open_.size() && place >= before + open_[at].most; ++at) before += open_[at].most;
    Drawn drawn = drawn_below(tree, region, open_[at], (place - before) / open_[at].most);
    drawn.times *= part;
    drawn_.push_back(drawn);
  }
}

LightChoice::Drawn LightChoice::drawn_below(const LightTree& tree, const LitRegion& region, const Open& open,
                                            double place) const {
  std::uint32_t node = open.node;
  double density = open.most;
  const auto most_of = [&](std::uint32_t child) {
    const LightReach& reach = tree.nodes_[child].reach;
    return reach.may_light(region) ? reach.most(region) : 0;
  };
  while (!tree.nodes_[node].is_leaf()) {
    const double one = most_of(node + 1), other = most_of(tree.nodes_[node].other);
    if (!(one + other > 0)) return {tree.order_[tree.nodes_[node].begin], 0};
    const double share = one / (one + other);
    const bool is_one = place < share || other == 0;
    place = is_one ? place / share : (place - share) / (1 - share);
    density *= is_one ? share : 1 - share;
    node = is_one ? node + 1 : tree.nodes_[node].other;
  }
  return {tree.order_[tree.nodes_[node].begin], 1 / density};
}

}  // namespace penumbra::shading
