#include "drivers/world/route.hpp"

namespace probebox::world {

void Route::add(SafePath path) {
  for (; !path.done(); path.pass()) add(path.next());
}

Route Route::within(const Place& place, const Vector3& from, const Vector3& to) {
  Route route;
  if (place.shape == Place::Shape::gap) {
    route.add(to);
  } else {
    route.add(SafePath{from, to, place.centre, place.keep_out_mm});
  }
  return route;
}

Route Route::up(const Place& place, const Vector3& from, double height_mm) {
  Route route;
  Vector3 aside = from;
  if (place.shape == Place::Shape::gap) {
    aside = place.centre;
  } else if (norm(from - place.centre) < place.keep_out_mm) {
    aside = place.centre + place.keep_out_mm * unit(from - place.centre);
  }
  route.add(aside);
  route.add({aside[0], aside[1], height_mm});
  return route;
}

Route Route::down(const Place& place, const Vector3& from, const Vector3& to) {
  Route route;
  if (place.shape == Place::Shape::beside) {
    const Vector3 aside = place.centre + place.keep_out_mm * unit(to - place.centre);
    route.add({aside[0], aside[1], from[2]});
    route.add(aside);
    route.add(to);
    return route;
  }
  const Vector3 above{place.centre[0], place.centre[1], from[2]};
  route.add(above);
  if (place.shape == Place::Shape::gap) {
    route.add(place.centre);
    route.add(to);
  } else {
    route.add(SafePath{above, to, place.centre, place.keep_out_mm});
  }
  return route;
}

}  // namespace probebox::world
