function r = simulate(model, changes)
  loop = model.loop;
  run = model.run;
  run.parameters = model.defaults;
  run.controller_parameters = loop.parameter_defaults;
  run.setpoint = loop.setpoint;
  if nargin > 1
    run = changed(run, changes);
  end
  s = begin_run(model, run);
  check_parameters(run.controller_parameters, loop.parameters, loop.parameter_minimum, loop.parameter_maximum);
  rows = struct('times', run.times(:), 'next', 1, 'count', 0, 'near', loop.near, 'setpoint', run.setpoint, 'piece', 0);
  rows.start = run.start;
  rows.measured = zeros(size(loop.measured_at, 1), 1);
  rows.command = zeros(numel(loop.commanded), 1);
  r.names = [{'time'}, model.states, model.inputs, model.output_names, loop.columns];
  rows.data = zeros(numel(rows.times), numel(r.names));
  memory = loop.initial_memory;
  segment = 0;
  signals = repmat({zeros(3, 0)}, 1, numel(model.inputs));
@driver_arrays@  applied = run.values(1, :)';
  status = 0;
  r.samples = 0;
  for k = 0:loop.samples - 1
    [start, finish] = deal(instant(run, loop, k), instant(run, loop, k + 1));
    values = {s.x, outputs(s.x, applied, s.c)};
    for j = 1:numel(rows.measured)
      rows.measured(j) = values{loop.measured_at(j, 1) + 1}(loop.measured_at(j, 2) + 1);
    end
    [wanted, rows.piece] = setpoints_now(run.setpoint, rows.piece, start, run.start);
    [rows.command, memory] = control_sample(rows.measured, wanted, memory, run.controller_parameters);
    if ~all(isfinite([rows.measured; wanted(:); rows.command]))
      status = 3;
      break
    end
    r.samples = r.samples + 1;
    [segment, count, signals] = cut_segments(run.ends, run.values, run.slopes, numel(run.ends) - 1, run.start, ...
      segment, start, finish, rows.command, loop.commanded, signals);
    counts = count * ones(1, numel(signals));
@apply_drivers@    [s, rows, applied, status] = run_interval(s, rows, start, finish, signals, counts);
    if status ~= 0
      break
    end
  end
  while status == 0 && rows.next <= numel(rows.times)
    rows = write_next(rows, s);
  end
  r.data = rows.data(1:rows.count, :);
  r = ended(r, s, status);
end

function time = instant(run, loop, k)
  if k == 0
    time = run.start;
  elseif k < loop.samples
    time = run.start + loop.sample_time * k;
  else
    time = loop.finish;
  end
end

function [values, piece] = setpoints_now(signal, piece, time, start)
  [piece, values] = setpoints_at(signal.ends, signal.values, signal.slopes, numel(signal.ends) - 1, start, piece, ...
    time, zeros(size(signal.values, 2), 1));
end

% From one sample to the next, in the common segments of all inputs.
function [s, rows, applied, status] = run_interval(s, rows, start, finish, signals, counts)
  [count, ~, ~, ends, values, slopes] = merge_columns(signals, counts, [], [], start, [], [], [], 0);
  status = 0;
  for k = 1:count
    margin = @close@;
    if ends(k) < finish
      margin = rows.near;
    end
    [s, rows, status] = run_segment(s, rows, ends(k), k > 1, margin, values(k, :)', slopes(k, :)');
    if status ~= 0
      break
    end
  end
  applied = inputs_at(s, finish);
end

% One segment, in which the inputs are linear; `between`: it begins between two samples, where a row is written.
function [s, rows, status] = run_segment(s, rows, finish, between, margin, u, w)
  first = s.t;
  count = numel(rows.times);
  status = 0;
  s = begin_segment(s, finish, u, w);
  if between
    rows = write_row(rows, first, s);
    while rows.next <= count && rows.times(rows.next) <= first + rows.near
      rows.next = rows.next + 1;
    end
  end
  while rows.next <= count && rows.times(rows.next) <= first + @close@
    rows = write_next(rows, s);
  end
  while s.t < finish && status == 0
    [s, status] = step(s);
    while status == 0 && rows.next <= count && rows.times(rows.next) < min(s.t + @close@, finish - margin)
      rows = write_next(rows, s);
    end
  end
  % rows close to the instant at the end of the segment
  while rows.next <= count && margin > @close@ && rows.times(rows.next) < finish
    rows.next = rows.next + 1;
  end
end

function rows = write_next(rows, s)
  rows = write_row(rows, rows.times(rows.next), s);
  rows.next = rows.next + 1;
end

function rows = write_row(rows, time, s)
  x = state_at(s, time);
  u = inputs_at(s, time);
  [shown, rows.piece] = setpoints_now(rows.setpoint, rows.piece, time, rows.start);
  rows.count = rows.count + 1;
  rows.data(rows.count, :) = [time; x; u; outputs(x, u, s.c); shown; rows.measured; rows.command]';
end

@kernels@