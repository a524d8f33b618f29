// Kernel that steps 16 joints at once, one in each lane (core/joints/JOINTS.md). One source serves vectors of
// any width.
#pragma once

#include "core/joint_table.hpp"
#include "lanes.hpp"
#include "slide.hpp"

namespace bristle::detail {
namespace {

using JointEngine = Engine<double>;

/// A quantity that depends on the direction of motion: its values forward and backward.
template <class V>
struct BothDirections {
  V forward, backward;
};

template <class E, std::uint32_t variant>
void step_joints(const JointStep& step) {
  using V = typename E::V;
  constexpr bool loaded = (variant & joint_loaded) != 0;
  constexpr bool drops = (variant & joint_drops) != 0;
  constexpr bool gradients = (variant & joint_gradients) != 0;
  constexpr bool all = gradients || (variant & joint_all_outputs) != 0;
  constexpr JointLayout at(variant, 0);
  constexpr std::uint32_t rows = gradients ? std::uint32_t{joint_parameters} : 1u;
  const std::uint32_t n = step.bristles;
  const JointLayout room(variant, n);
  const V none(0.0), one(1.0), two(2.0);

  for (std::uint32_t first = 0; first < lane_count; first += E::size) {
    const auto column = [&](std::uint32_t c) { return step.columns + c * lane_count + first; };
    const auto get = [&](std::uint32_t c) { return E::get(column(c)); };
    const auto constant = [&](std::uint32_t c) { return E::get(step.constants + c * lane_count + first); };
    const auto in = [&](std::uint32_t row) { return E::get(step.in + row * lane_count + first); };
    const auto put = [&](std::uint32_t row, V x) { E::put(step.out + row * lane_count + first, x); };
    const auto writes = in(in_writes) > none;
    const V angle = in(in_angle), speed = in(in_speed);
    const V before = get(at.before);
    const V stiffness = constant(at.parameter[joint_stiffness]);
    const V flexibility = divide(one, stiffness);
    const V moved = angle - before;
    const V e = select_lanes(moved < none, none - one, one);
    const V length = moved * e;

    // Allows for rounding in a bristle's position. Otherwise a bristle at its limit could count as beyond it
    // and slide in a joint that rests.
    const V slack = most(before, none - before) * V(0x1p-50);

    // Computes the limits of the friction torque of the whole joint, for forward and for backward motion.
    V motor = none, outside = none, motor_size = none, outside_size = none;
    auto drives_forward = none > one, drives_backward = none > one;
    if constexpr (loaded) {
      motor = in(in_motor);
      outside = in(in_outside);
      motor_size = most(motor, none - motor);
      outside_size = most(outside, none - outside);
      drives_forward = motor > none;
      drives_backward = motor < none;
    }
    const auto losses = [&](std::uint32_t base) {
      BothDirections<V> torque{constant(at.parameter[base]), constant(at.parameter[base])};
      if constexpr (loaded) {
        const V driving =
            motor_size * constant(at.parameter[base + 1]) + outside_size * constant(at.parameter[base + 3]);
        const V driven =
            motor_size * constant(at.parameter[base + 2]) + outside_size * constant(at.parameter[base + 4]);
        torque.forward = torque.forward + select_lanes(drives_forward, driving, driven);
        torque.backward = torque.backward + select_lanes(drives_backward, driving, driven);
      }
      return torque;
    };
    BothDirections<V> slides_at = losses(joint_base);
    BothDirections<V> starts_at = slides_at;
    BothDirections<V> static_part{none, none};
    V left = none, inverse_square = none;
    if constexpr (drops) {
      static_part = losses(joint_static_base);
      inverse_square = constant(at.parameter[joint_stribeck_speed]);
      left = decay<double>(most(speed * speed * inverse_square, constant(at.least_decay))).left;
      starts_at = {slides_at.forward + static_part.forward, slides_at.backward + static_part.backward};
      slides_at = {slides_at.forward + left * static_part.forward,
                   slides_at.backward + left * static_part.backward};
    }

    // Derivatives of `slides_at`, the limit at which bristles slide, by each parameter of the material.
    BothDirections<V> limit_by[rows];
    if constexpr (gradients) {
      for (BothDirections<V>& x : limit_by) x = {none, none};
      const auto fill = [&](std::uint32_t base, V share) {
        limit_by[base] = {share, share};
        if constexpr (loaded) {
          const V m = share * motor_size, o = share * outside_size;
          limit_by[base + 1] = {select_lanes(drives_forward, m, none),
                                select_lanes(drives_backward, m, none)};
          limit_by[base + 2] = {select_lanes(drives_forward, none, m),
                                select_lanes(drives_backward, none, m)};
          limit_by[base + 3] = {select_lanes(drives_forward, o, none),
                                select_lanes(drives_backward, o, none)};
          limit_by[base + 4] = {select_lanes(drives_forward, none, o),
                                select_lanes(drives_backward, none, o)};
        }
      };
      fill(joint_base, one);
      if constexpr (drops) {
        fill(joint_static_base, left);
        const V by_speed = left * (two * speed * speed * inverse_square) * root(inverse_square);
        limit_by[joint_stribeck_speed] = {static_part.forward * by_speed, static_part.backward * by_speed};
      }
    }

    V sum = none, mean = none, stuck = none, limit_forward = none, limit_backward = none;
    V sum_by[rows];
    if constexpr (gradients)
      for (V& x : sum_by) x = none;
    for (std::uint32_t i = 0; i < n; ++i) {
      const V share(step.share[i]), relative(step.length[i]);
      const V scale = relative * flexibility;
      const V tip = get(at.tips + i);
      const BothDirections<V> limit{slides_at.forward * scale, slides_at.backward * scale};
      BothDirections<V> reach = limit;
      if constexpr (drops) {
        const auto slid = get(room.slid + i) > none;
        reach = {select_lanes(slid, limit.forward, starts_at.forward * scale),
                 select_lanes(slid, limit.backward, starts_at.backward * scale)};
      }
      // Lets a bristle slide whose limit fell below its deflection, even in a joint that does not move.
      const V bent = before - tip;
      const auto beyond_forward = bent > reach.forward + slack;
      const auto beyond_backward = none - bent > reach.backward + slack;
      const V z = select_lanes(beyond_forward, limit.forward,
                               select_lanes(beyond_backward, none - limit.backward, bent));
      const V limit_ahead = select_lanes(e > none, limit.forward, limit.backward);
      const SlideStart<V> start = slide_start<double, 1>(z, none, e, none);
      V start_limit = limit_ahead;
      if constexpr (drops) {
        // Restores the static limit of a bristle that slid when the motion reverses, because it sticks then.
        const auto reverses = start.along < none;
        start_limit = select_lanes(e > none, select_lanes(reverses, starts_at.forward * scale, reach.forward),
                                   select_lanes(reverses, starts_at.backward * scale, reach.backward));
        start_limit = select_lanes((beyond_forward | beyond_backward) & !reverses, limit_ahead, start_limit);
      }
      const V path = least(path_to_slide<double, 1>(start, start_limit), length);
      const Slid<V> end =
          slide_after<double, 1, all, false>(start, path, start_limit, limit_ahead, e, none, length);
      const auto slides = path < length;
      const auto moves = slides | beyond_forward | beyond_backward;
      E::put(column(at.tips + i), select_lanes(moves & writes, angle - end.x, tip));
      if constexpr (drops) {
        const V was = get(room.slid + i);
        E::put(column(room.slid + i), select_lanes(writes, select_lanes(moves, one, none), was));
      }
      sum = sum + share * end.x;
      if constexpr (all) {
        mean = mean + share * select_lanes(length > none, end.integral_x, end.x);
        stuck = stuck + select_lanes(slides, none, share);
        // Direction in which the bristle slides: 1 forward, -1 backward, 0 if it sticks. While it slides, its
        // deflection is the limit in that direction.
        const V side = select_lanes(
            slides, e, select_lanes(beyond_forward, one, select_lanes(beyond_backward, none - one, none)));
        const V part = share * relative;
        limit_forward = limit_forward + part * most(side, none);
        limit_backward = limit_backward + part * most(none - side, none);
        if constexpr (gradients) {
          for (std::uint32_t p = 0; p < joint_parameters; ++p) {
            if (!JointLayout::uses(p, variant) || p == joint_viscous) continue;
            const std::uint32_t c = room.gradients + i * joint_parameters + p;
            const V old = get(c);
            V by = scale * select_lanes(side > none, limit_by[p].forward, none - limit_by[p].backward);
            if (p == joint_stiffness)
              by = none - flexibility * select_lanes(side > none, limit.forward, none - limit.backward);
            const V tip_by = select_lanes(side * side > none, none - by, old);
            E::put(column(c), select_lanes(writes, tip_by, old));
            sum_by[p] = sum_by[p] - share * tip_by;
          }
        }
      }
    }

    V viscous = constant(at.parameter[joint_viscous]);
    const V damper = viscous * speed;
    put(out_torque, none - (stiffness * sum + damper));
    if constexpr (all) {
      mean = select_lanes(length > none, divide(mean, most(length, V(1e-300))), mean);
      put(out_mean, none - (stiffness * mean + damper));
      put(out_by_angle, none - stiffness * stuck);
      V by_speed = none - viscous;
      if constexpr (drops) {
        const V slope = two * speed * inverse_square * left;
        by_speed =
            by_speed + slope * (limit_forward * static_part.forward - limit_backward * static_part.backward);
      }
      put(out_by_speed, by_speed);
      V by_motor = none, by_outside = none;
      if constexpr (loaded) {
        const auto slope = [&](std::uint32_t driving) {
          const auto total = [&](std::uint32_t k) {
            V x = constant(at.parameter[joint_base + k]);
            if constexpr (drops) x = x + left * constant(at.parameter[joint_static_base + k]);
            return x;
          };
          const V a = total(driving), b = total(driving + 1);
          return limit_forward * select_lanes(drives_forward, a, b) -
                 limit_backward * select_lanes(drives_backward, a, b);
        };
        by_motor = slope(1) * select_lanes(motor < none, one, none - one);
        by_outside = slope(3) * select_lanes(outside < none, one, none - one);
      }
      put(out_by_motor, by_motor);
      put(out_by_outside, by_outside);
      if constexpr (gradients)
        for (std::uint32_t p = 0; p < joint_parameters; ++p) {
          V total = none - stiffness * sum_by[p];
          if (p == joint_stiffness) total = total - sum;
          if (p == joint_viscous) total = none - speed;
          put(out_gradient + p, total);
        }
    }
    E::put(column(at.before), select_lanes(writes, angle, before));
  }
}

}  // namespace
}  // namespace bristle::detail
