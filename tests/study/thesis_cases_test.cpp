#include <gtest/gtest.h>
#include <cstdio>
#include <chrono>
#include <cstdlib>
#include "unflex/study/bench.hpp"
#include "unflex/study/case.hpp"
namespace unflex::study {
TEST(Proto, Show) {
  const auto engine = compensate::make_banded_engine();
  auto env=[](const char*n,double d){const char*s=getenv(n);return s?atof(s):d;};
  for (const Case& c : thesis_cases()) {
    BenchSetup s; s.unflex.x.axis=s.unflex.y.axis=c.axis; s.plan_accel_mm_s2=c.accel_mm_s2; s.thesis_period_s=c.period_s;
    s.unflex.lead_in_s=env("LEAD",0.01); s.unflex.tail_s=env("TAIL",0.08); s.unflex.jerk_weight=env("JERK",1.5); s.hold_s=0.5; s.unflex.travel_weight=env("TW",.1);
    auto t0=std::chrono::steady_clock::now();
    study::Run r{corner(c,c.accel_mm_s2),corner(c,c.accel_mm_s2/2)};
    auto res=try_all(r,s,*engine);
    printf("== %s %.0f ms\n",std::string(c.name).c_str(),1e3*std::chrono::duration<double>(std::chrono::steady_clock::now()-t0).count());
    for(auto&m:res){ if(getenv("ONLY")&&!(m.method==Method::unflex_4x||m.method==Method::unflex_2x||m.method==Method::unflex_10x))continue;
     if(!m.used){printf("%-30s %s\n",std::string(name(m.method)).c_str(),m.remark.c_str());continue;}
     printf("%-30s",std::string(name(m.method)).c_str()); for(auto&e:m.straying)printf(" %8.2f",e.max_mm*1e3); printf(" rms %.3f after %.2f  peak %.0f %.0f gap %.3f longer %.3f it %d %s\n",m.straying[0].rms_mm()*1e3,m.straying[0].after_max_mm*1e3,m.base_peak.velocity_mm_s,m.base_peak.accel_mm_s2,m.end_gap_mm,m.longer_s,m.iterations,m.remark.c_str());}
  }
}
}
