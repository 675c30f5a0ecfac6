// The kernel of bundle_kernel.hpp. Included once for each kind of lanes (unflex/core/lanes.hpp), so
// there is nothing here but templates over lanes, and nothing is included.
//
// Notation:
//   q, b        a mode's part of the nozzle's place, and the base
//   e           the way from the path to the nozzle, |e| = c
//   e₀, e₁, e₂  c² at three looks

namespace unflex::verify {

template <class Lanes>
class LaneBundle final : public BundleKernel {
 public:
  void set_maps(double h, int rk4_steps, BundleArrays& at) const override {
    const std::size_t parts = at.parts();
    const Lanes none = broadcast<Lanes>(0.0);
    const Lanes one = broadcast<Lanes>(1.0);
    for (std::size_t place = 0; place < parts; place += kLanes) {
      const Mode mode = mode_at(place, at);
      const auto put = [&](std::size_t unit, Motion motion, const dynamics::BaseSegment& base) {
        moved(mode, base, h, rk4_steps, motion);
        store(motion.position, at.maps[unit].data() + place);
        store(motion.velocity, at.maps[unit].data() + parts + place);
      };
      put(0, {one, none}, {});
      put(1, {none, one}, {});
      put(2, {none, none}, {0.0, 1.0, 0.0});
      put(3, {none, none}, {0.0, 0.0, 1.0});
    }
  }

  // The base's position is carried along so that numbers stay small.
  void step_by_maps(const dynamics::BaseXY& xy, BundleArrays& at) const override {
    const std::size_t parts = at.parts();
    for (std::size_t place = 0; place < parts; place += kLanes) {
      const dynamics::BaseSegment& base = 2 * place < parts ? xy.x : xy.y;
      double* const position = at.states.data() + place;
      double* const velocity = position + parts;
      const Lanes by_base = base.position * load<Lanes>(at.gain.data() + place);
      const Lanes off = load<Lanes>(position) - by_base;
      const Lanes rate = load<Lanes>(velocity);
      const auto next = [&](std::size_t row) {
        return (load<Lanes>(at.maps[0].data() + row) * off +
                load<Lanes>(at.maps[1].data() + row) * rate) +
               (base.velocity * load<Lanes>(at.maps[2].data() + row) +
                base.acceleration * load<Lanes>(at.maps[3].data() + row));
      };
      store(by_base + next(place), position);
      store(next(parts + place), velocity);
    }
  }

  void step(const dynamics::BaseXY& xy, double h, int rk4_steps, BundleArrays& at) const override {
    const std::size_t parts = at.parts();
    for (std::size_t place = 0; place < parts; place += kLanes) {
      double* const position = at.states.data() + place;
      double* const velocity = position + parts;
      Motion motion{load<Lanes>(position), load<Lanes>(velocity)};
      moved(mode_at(place, at), 2 * place < parts ? xy.x : xy.y, h, rk4_steps, motion);
      store(motion.position, position);
      store(motion.velocity, velocity);
    }
  }

  void look(const ReferencePath& path, NearPath& near, double before_h, double h,
            BundleArrays& at) const override {
    for (std::size_t place = 0; place < at.places; place += kLanes) {
      const Lanes px = nozzles(0, place, at);
      const Lanes py = nozzles(1, place, at);
      const Lanes vx = nozzles(0, place + at.parts(), at);
      const Lanes vy = nozzles(1, place + at.parts(), at);
      const Found found = nearest(path, near, px, py);
      const Away away = away_from(near, found, px, py, vx, vy);
      Lanes mean = found.distance2;
      Lanes largest = found.distance2;
      if (h > 0.0) {
        const Lanes e1 = load<Lanes>(at.now_mm2.data() + place);
        const Lanes e2 = found.distance2;
        largest = larger(e1, e2);
        if (before_h > 0.0) {
          const Lanes e0 = load<Lanes>(at.before_mm2.data() + place);
          largest = larger(largest, top(e0, e1, e2, before_h, h));
        }
        const Lanes pieces = found.number - load<Lanes>(at.nearest.data() + place);
        const Lanes bends = pieces * pieces + away.is_at_end +
                            load<Lanes>(at.away[BundleArrays::kIsAtEnd].data() + place);
        const Lanes none = broadcast<Lanes>(0.0);
        mean = mean_of_cubics(h, place, away, at);
        if (most(bends) > 0.0) {
          // Where the path bends, so does e. Then the middle is looked at, too.
          const auto middle = [&](std::size_t axis, const Lanes& to, const Lanes& rate) {
            return 0.5 * (load<Lanes>(at.was[axis].data() + place) + to) +
                   0.125 * h * (load<Lanes>(at.was[2 + axis].data() + place) - rate);
          };
          const Lanes e = nearest(path, near, middle(0, px, vx), middle(1, py, vy)).distance2;
          const auto is_bent = less(none, bends);
          mean = select(is_bent, 1.0 / 6.0 * (e1 + 4.0 * e + e2), mean);
          largest = select(is_bent, larger(largest, e), largest);
        }
      }
      store(load<Lanes>(at.now_mm2.data() + place), at.before_mm2.data() + place);
      store(found.distance2, at.now_mm2.data() + place);
      store(mean, at.mean_mm2.data() + place);
      store(largest, at.largest_mm2.data() + place);
      store(found.number, at.nearest.data() + place);
      store(away.x, at.away[0].data() + place);
      store(away.y, at.away[1].data() + place);
      store(away.rate_x, at.away[2].data() + place);
      store(away.rate_y, at.away[3].data() + place);
      store(away.is_at_end, at.away[BundleArrays::kIsAtEnd].data() + place);
      store(px, at.was[0].data() + place);
      store(py, at.was[1].data() + place);
      store(vx, at.was[2].data() + place);
      store(vy, at.was[3].data() + place);
    }
  }

 private:
  // Pieces of the path, by their numbers, and the squares of the distances from them.
  struct Found {
    Lanes distance2;
    Lanes number;
  };
  // e and its rate, and 1 where the end of a piece is nearest.
  struct Away {
    Lanes x;
    Lanes y;
    Lanes rate_x;
    Lanes rate_y;
    Lanes is_at_end;
  };

  [[nodiscard]] static Found nearest(const ReferencePath& path, NearPath& near, const Lanes& px,
                                     const Lanes& py) {
    const NearPath::Span* const spans = near.spans();
    const std::size_t count = near.span_count();
    const bool begins_cut = near.begins_cut();
    const bool ends_cut = near.ends_cut();
    Lanes best = broadcast<Lanes>(1e300);
    Lanes number = broadcast<Lanes>(0.0);
    for (std::size_t i = 0; i < count; ++i) {
      const NearPath::Span& span = spans[i];
      const Lanes x = px - broadcast<Lanes>(span.start_mm.x);
      const Lanes y = py - broadcast<Lanes>(span.start_mm.y);
      Lanes along = span.direction.x * x + span.direction.y * y;
      along = smaller(larger(along, broadcast<Lanes>(0.0)), broadcast<Lanes>(span.length_mm));
      if (begins_cut && i == 0 && least(along) < near.begin_bound_mm(path)) {
        along = larger(along, broadcast<Lanes>(near.begin_mm(path)));
      }
      if (ends_cut && i + 1 == count && most(along) > near.end_bound_mm(path)) {
        along = smaller(along, broadcast<Lanes>(near.end_mm(path)));
      }
      const Lanes across_x = x - span.direction.x * along;
      const Lanes across_y = y - span.direction.y * along;
      const Lanes distance2 = across_x * across_x + across_y * across_y;
      const auto is_nearer = less(distance2, best);
      best = select(is_nearer, distance2, best);
      number = select(is_nearer, broadcast<Lanes>(static_cast<double>(i)), number);
    }
    return {best, number + broadcast<Lanes>(static_cast<double>(near.first()))};
  }

  // Only what goes across a piece changes e. Where that is not all of e, the piece ends or is cut.
  [[nodiscard]] static Away away_from(const NearPath& near, const Found& found, const Lanes& px,
                                      const Lanes& py, const Lanes& vx, const Lanes& vy) {
    double number[kLanes];
    store(found.number - broadcast<Lanes>(static_cast<double>(near.first())), number);
    const NearPath::Span* s[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      s[lane] = near.spans() + static_cast<std::size_t>(number[lane]);
    }
    const auto of = [&](XY NearPath::Span::*value, double XY::*axis) {
      return gathered<Lanes>(s[0]->*value.*axis, s[1]->*value.*axis, s[2]->*value.*axis,
                             s[3]->*value.*axis);
    };
    const Lanes direction_x = of(&NearPath::Span::direction, &XY::x);
    const Lanes direction_y = of(&NearPath::Span::direction, &XY::y);
    const Lanes x = px - of(&NearPath::Span::start_mm, &XY::x);
    const Lanes y = py - of(&NearPath::Span::start_mm, &XY::y);
    const Lanes along = direction_x * x + direction_y * y;
    const Lanes speed = direction_x * vx + direction_y * vy;
    const Lanes across_x = x - direction_x * along;
    const Lanes across_y = y - direction_y * along;
    const Lanes is_at_end = select(less(across_x * across_x + across_y * across_y, found.distance2),
                                   broadcast<Lanes>(1.0), broadcast<Lanes>(0.0));
    return {across_x, across_y, vx - direction_x * speed, vy - direction_y * speed, is_at_end};
  }

  // The top of the parabola through three looks where the middle look is the highest, otherwise
  // zero. If looks are equally far apart, the top is no more than 9/8 of the middle. This bound is
  // kept if they are not.
  [[nodiscard]] static Lanes top(const Lanes& e0, const Lanes& e1, const Lanes& e2, double before_h,
                                 double h) {
    constexpr double kMost = 1.125;
    const Lanes none = broadcast<Lanes>(0.0);
    const Lanes rise = (1.0 / before_h) * (e1 - e0);
    const Lanes fall = (1.0 / h) * (e1 - e2);
    const double both = 1.0 / (before_h + h);
    const Lanes slope = both * (h * rise - before_h * fall);
    const Lanes bend = both * (rise + fall);  // minus half the second derivative
    const Lanes safe_bend = select(less(none, bend), bend, broadcast<Lanes>(1.0));
    const Lanes highest = smaller(e1 + 0.25 * (slope * slope / safe_bend), kMost * e1);
    return select(less(fall, none), none, select(less(none, rise), highest, none));
  }

  // The mean of e² if e goes from look to look by cubics with the rates at both, as it does beside
  // one piece. For a to b, with h times the rates s and t, it is
  //   (156 a² + 44 a s + 4 s² + 108 a b − 26 a t + 26 s b − 6 s t + 156 b² − 44 b t + 4 t²) / 420
  [[nodiscard]] static Lanes mean_of_cubics(double h, std::size_t place, const Away& to,
                                            const BundleArrays& at) {
    const auto mean = [&](std::size_t axis, const Lanes& b, const Lanes& rate) {
      const Lanes a = load<Lanes>(at.away[axis].data() + place);
      const Lanes s = h * load<Lanes>(at.away[2 + axis].data() + place);
      const Lanes t = h * rate;
      return a * (156.0 * a + 44.0 * s + 108.0 * b - 26.0 * t) +
             s * (4.0 * s + 26.0 * b - 6.0 * t) + b * (156.0 * b - 44.0 * t) + 4.0 * (t * t);
    };
    return 1.0 / 420.0 * (mean(0, to.x, to.rate_x) + mean(1, to.y, to.rate_y));
  }

  struct Mode {
    Lanes stiffness;
    Lanes damping;
    Lanes gain;
    Lanes lead;
  };
  // How a mode's part moves.
  struct Motion {
    Lanes position;
    Lanes velocity;
  };

  [[nodiscard]] static Mode mode_at(std::size_t place, const BundleArrays& at) {
    return {load<Lanes>(at.stiffness_per_s2.data() + place),
            load<Lanes>(at.damping_per_s.data() + place), load<Lanes>(at.gain.data() + place),
            load<Lanes>(at.lead_s.data() + place)};
  }

  // dynamics::rk4_step() for four nozzles, as many times as asked for.
  static void moved(const Mode& mode, const dynamics::BaseSegment& base, double h, int rk4_steps,
                    Motion& motion) {
    const double dt = h / rk4_steps;
    for (int i = 0; i < rk4_steps; ++i) {
      const double from = i * dt;
      const Lanes q = motion.position;
      const Lanes v = motion.velocity;
      const Lanes push_begin = push(mode, base, from);
      const Lanes push_middle = push(mode, base, from + 0.5 * dt);
      const Lanes push_end = push(mode, base, from + dt);
      const auto accel = [&](const Lanes& pushed, const Lanes& position, const Lanes& velocity) {
        return pushed - mode.stiffness * position - mode.damping * velocity;
      };
      const Lanes a1 = accel(push_begin, q, v);
      const Lanes v2 = v + 0.5 * dt * a1;
      const Lanes a2 = accel(push_middle, q + 0.5 * dt * v, v2);
      const Lanes v3 = v + 0.5 * dt * a2;
      const Lanes a3 = accel(push_middle, q + 0.5 * dt * v2, v3);
      const Lanes v4 = v + dt * a3;
      const Lanes a4 = accel(push_end, q + dt * v3, v4);
      motion.position = q + dt / 6.0 * (v + 2.0 * (v2 + v3) + v4);
      motion.velocity = v + dt / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
    }
  }

  // The acceleration that the base causes t seconds on.
  [[nodiscard]] static Lanes push(const Mode& mode, const dynamics::BaseSegment& base, double t) {
    const double position = base.position + t * (base.velocity + 0.5 * base.acceleration * t);
    const double velocity = base.velocity + base.acceleration * t;
    return mode.stiffness * (position * mode.gain + velocity * mode.lead) +
           velocity * (mode.damping * mode.gain);
  }

  [[nodiscard]] static Lanes nozzles(std::size_t axis, std::size_t nozzle, const BundleArrays& at) {
    Lanes sum = load<Lanes>(at.states.data() + at.place(axis, 0) + nozzle);
    for (std::size_t mode = 1; mode < at.modes; ++mode) {
      sum = sum + load<Lanes>(at.states.data() + at.place(axis, mode) + nozzle);
    }
    return sum;
  }
};

}  // namespace unflex::verify
