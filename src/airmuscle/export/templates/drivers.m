% The signal of an input after one of its drivers.
function [signal, driver] = driven(driver, signal, start)
  if driver.kind == 0
    [signal, driver] = modulate(driver, signal, start);
  else
    [signal, driver] = switch_with_delay(driver, signal, start);
  end
end

% Pulse width modulation; settings: frequency, smallest pulse; state: origin, periods begun, end of the last pulse.
function [pulses, driver] = modulate(driver, signal, start)
  finish = signal(end, 1);
  frequency = driver.settings(1);
  period = 1 / frequency;
  last = finish - 4 * eps(finish);
  smallest = max([driver.settings(2), 1e-9 * period, 4 * eps(finish)]);
  origin = driver.state(1);
  begun = driver.state(2);
  pulse_end = driver.state(3);
  total = ceil((finish - origin) * frequency - begun) + 1;
  levels = [start, pulse_end > start];
  if pulse_end > start && pulse_end < finish
    levels(end + 1, :) = [pulse_end, 0];
  end
  from = start;
  k = 1;
  periods = 0;
  for i = 0:total - 1
    time = origin + (begun + i) / frequency;
    if ~(time < last)
      continue
    end
    time = max(time, start);
    while k < size(signal, 1) && signal(k, 1) <= time
      from = signal(k, 1);
      k = k + 1;
    end
    width = period * min(max(signal(k, 2) + (time - from) * signal(k, 3), 0), 1);
    pulse_end = time + width;
    if width < smallest
      pulse_end = -Inf;
    elseif period - width < smallest
      pulse_end = Inf;
    end
    if periods == 0 && time == start
      levels = zeros(0, 2);
    end
    level = double(pulse_end > time);
    if isempty(levels) || level ~= levels(end, 2)
      levels(end + 1, :) = [time, level];
    end
    if pulse_end > time && pulse_end < finish
      levels(end + 1, :) = [pulse_end, 0];
    end
    periods = periods + 1;
  end
  driver.state(2) = begun + periods;
  driver.state(3) = pulse_end;
  pulses = [[levels(2:end, 1); finish], levels(:, 2), zeros(size(levels, 1), 1)];
end

% Instants at which a signal passes 0.5, with the new state of the coil.
function found = switchings(signal, start, coil)
  found = zeros(0, 2);
  for k = 1:size(signal, 1)
    first = signal(k, 2) >= 0.5;
    last = signal(k, 2) + signal(k, 3) * (signal(k, 1) - start) >= 0.5;
    if first ~= (coil > 0)
      coil = double(first);
      found(end + 1, :) = [start, coil];
    end
    if last ~= first
      coil = double(last);
      found(end + 1, :) = [min(start + (0.5 - signal(k, 2)) / signal(k, 3), signal(k, 1)), coil];
    end
    start = signal(k, 1);
  end
end

% A solenoid valve; settings: delays and ramps of opening and closing; state: coil, pending instant, target, opening.
function [moved, driver] = switch_with_delay(driver, signal, start)
  finish = signal(end, 1);
  moved = zeros(0, 3);
  coil = driver.state(1);
  pending = driver.state(2);
  target = driver.state(3);
  opening = driver.state(4);
  edge = start;
  for change = [switchings(signal, start, coil); Inf, coil]'
    if pending < min(change(1), finish) && coil ~= target
      [moved, opening] = move(moved, opening, target, edge, pending, driver.settings);
      edge = pending;
      target = coil;
    end
    if isfinite(change(1))
      coil = change(2);
      pending = change(1) + driver.settings(2 - (coil > 0));
    end
  end
  [moved, opening] = move(moved, opening, target, edge, finish, driver.settings);
  if pending < finish
    pending = Inf;
  end
  driver.state = [coil; pending; target; opening];
end

% The segments of an opening that moves to its target, from `edge` to `stop`.
function [moved, opening] = move(moved, opening, target, edge, stop, settings)
  if ~(stop > edge)
    return
  end
  ramp = settings(4 - (target > opening));
  distance = abs(target - opening);
  left = -Inf;
  if ramp > 0
    left = distance - (stop - edge) / ramp;
  end
  after = target;
  if left > 1e-12
    after = target + left * (2 * (opening >= target) - 1);
  end
  arrival = stop;
  if after == target
    arrival = min(edge + ramp * distance, stop);
  end
  if arrival > edge
    moved(end + 1, :) = [arrival, opening, (after - opening) / (arrival - edge)];
  end
  if stop > arrival
    moved(end + 1, :) = [stop, after, 0];
  end
  opening = after;
end

