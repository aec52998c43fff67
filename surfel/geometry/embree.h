// Ray queries of Embree 3 and of Embree 4, which takes filters and flags in other structs
// [Embree 4 API, rtcInitIntersectArguments, rtcInitOccludedArguments].
#pragma once

#ifndef SURFLECT_EMBREE
#error "SURFLECT_EMBREE is the version of Embree, 3 or 4"
#endif

#if SURFLECT_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <type_traits>

namespace surflect {

#if SURFLECT_EMBREE == 3

using EmbreeContext = RTCIntersectContext;
inline constexpr RTCSceneFlags kFiltersInQueries = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

// First hit of a ray; hit.geomID remains as it is if there is none.
inline void intersectRay(RTCScene scene, RTCRayHit& query) {
  EmbreeContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &query);
}

// Makes tfar negative if anything is in the way.
inline void occludeRay(RTCScene scene, RTCRay& ray) {
  EmbreeContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}

// Occlusion query that calls `filter` with `context` at every hit; the scene needs kFiltersInQueries.
inline void occludeRay(RTCScene scene, RTCRay& ray, RTCFilterFunctionN filter, EmbreeContext& context) {
  rtcInitIntersectContext(&context);
  context.filter = filter;
  rtcOccluded1(scene, &context, &ray);
}

// Occlusion of 8 or 16 rays; valid[i] is -1 for active rays.
template <class Packet>
void occludePacket(RTCScene scene, const int* valid, Packet& packet, bool isCoherent) {
  EmbreeContext context;
  rtcInitIntersectContext(&context);
  if (isCoherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  if constexpr (std::is_same_v<Packet, RTCRay16>)
    rtcOccluded16(valid, scene, &context, &packet);
  else
    rtcOccluded8(valid, scene, &context, &packet);
}

#else

using EmbreeContext = RTCRayQueryContext;
inline constexpr RTCSceneFlags kFiltersInQueries = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

inline void intersectRay(RTCScene scene, RTCRayHit& query) { rtcIntersect1(scene, &query, nullptr); }

inline void occludeRay(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray, nullptr); }

inline void occludeRay(RTCScene scene, RTCRay& ray, RTCFilterFunctionN filter, EmbreeContext& context) {
  rtcInitRayQueryContext(&context);
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER; // else each geometry must allow it
  arguments.context = &context;
  arguments.filter = filter;
  rtcOccluded1(scene, &ray, &arguments);
}

template <class Packet>
void occludePacket(RTCScene scene, const int* valid, Packet& packet, bool isCoherent) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  if (isCoherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  if constexpr (std::is_same_v<Packet, RTCRay16>)
    rtcOccluded16(valid, scene, &packet, &arguments);
  else
    rtcOccluded8(valid, scene, &packet, &arguments);
}

#endif

} // namespace surflect
