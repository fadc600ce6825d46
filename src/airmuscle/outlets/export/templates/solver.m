function [s, result] = step(s)
  result = s.refusal;
  if result ~= 0
    return
  end
  @single_step_work@
  @single_step@
  s.rejected = s.rejected + rejections;
  s.h = following;
  if result ~= 0
    return
  end
  s.x_before = s.x;
  s.x = yn;
  s.t_before = s.t;
  s.t = reached;
  s.h_taken = taken;
  s.steps = s.steps + 1;
  s.done = s.done + 1;
end

function between = state_at(s, time)
  between = s.x;
  if s.steps > 0 && time < s.t - @close@
    @state_between_work@
    @state_between@
  end
end

@steps@